#include "sim_plant/map_zero.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim_plant/map_slope.h"
#include "sim_plant/map_surface.h"

#define TWO_PI 6.28318530717958647693
#define ARRAYS 9 /* psi_0 and its derivatives, as in map_node_t */

typedef struct {
    map_line_t along_d, along_q;
    int count_d, count_q, nodes;
    double *f[ARRAYS], *work;
    double *memory;
} nodes_t;

static void slopes_d(const nodes_t *n, const double *f, double *slope)
{
    for (int j = 0; j < n->count_q; j++) {
        map_slope_spline(&n->along_d, f + j, slope + j, n->work);
    }
}

static void slopes_q(const nodes_t *n, const double *f, double *slope)
{
    for (int k = 0; k < n->nodes; k += n->count_q) {
        map_slope_spline(&n->along_q, f + k, slope + k, n->work);
    }
}

/* Derivatives of the values in f[0] by splines along both axes: members of map_node_t in their order */
static void set_nodes(nodes_t *n, map_node_t *nodes)
{
    double **f = n->f;
    slopes_d(n, f[0], f[1]);
    slopes_q(n, f[0], f[2]);
    slopes_d(n, f[1], f[3]);
    slopes_q(n, f[1], f[4]);
    slopes_q(n, f[2], f[5]);
    slopes_q(n, f[3], f[6]);
    slopes_q(n, f[4], f[7]);
    slopes_q(n, f[6], f[8]);
    for (int k = 0; k < n->nodes; k++) {
        nodes[k] =
            (map_node_t){f[0][k], f[1][k], f[2][k], f[3][k], f[4][k], f[5][k], f[6][k], f[7][k], f[8][k]};
    }
}

/* Whether the data are half a period of psi_0: see map_zero.h */
static bool halves(const map_table_data_t *data)
{
    return data->theta_order % 2 == 0;
}

/* One layer's values at the nodes, of a series over `count` samples of which the data may be the first half
 */
static void split(const map_table_data_t *data, const double *psi_0_Wb, int layer, int nodes, double *psi)
{
    int given = data->count_theta;
    int count = halves(data) ? 2 * given : given;
    for (int k = 0; k < nodes; k++) {
        double sum = 0.0;
        for (int n = 0; n < count; n++) {
            double x = TWO_PI * (n * ((layer + 1) / 2) % count) / count;
            double wave = layer % 2 == 1 || layer == 0 ? cos(x) : sin(x);
            sum += (n < given ? 1.0 : -1.0) * psi_0_Wb[k * given + n % given] * wave;
        }
        psi[k] = (layer == 0 ? 1.0 : 2.0) * sum / count;
    }
}

static bool allocate(nodes_t *n, const map_table_data_t *data)
{
    int most = data->count_d > data->count_q ? data->count_d : data->count_q;
    n->count_d = data->count_d;
    n->count_q = data->count_q;
    n->nodes = data->count_d * data->count_q;
    n->along_d = (map_line_t){data->count_d, data->count_q, data->i_d_A};
    n->along_q = (map_line_t){data->count_q, 1, data->i_q_A};
    n->memory = malloc(((size_t)ARRAYS * (size_t)n->nodes + (size_t)most) * sizeof *n->memory);
    for (int k = 0; k < ARRAYS && n->memory != NULL; k++) {
        n->f[k] = n->memory + (size_t)k * (size_t)n->nodes;
    }
    n->work = n->memory != NULL ? n->memory + (size_t)ARRAYS * (size_t)n->nodes : NULL;
    return n->memory != NULL;
}

static map_table_t *surface(const map_table_t *map, const map_table_data_t *data)
{
    int count = halves(data) ? 2 * data->count_theta : data->count_theta;
    int harmonics = (count - 1) / 2 < MAP_HARMONICS ? (count - 1) / 2 : MAP_HARMONICS;
    map_table_t *zero = malloc(sizeof *zero);
    if (zero == NULL) {
        return NULL;
    }
    *zero = *map;
    zero->zero = NULL;
    zero->layers = 1 + 2 * harmonics;
    zero->theta_order = halves(data) ? data->theta_order / 2 : data->theta_order;
    size_t cells = (size_t)(map->d.count - 1) * (size_t)(map->q.count - 1);
    zero->patch = malloc(cells * (size_t)zero->layers * MAP_PATCH * sizeof *zero->patch);
    if (zero->patch == NULL) {
        free(zero);
        return NULL;
    }
    return zero;
}

bool map_zero_add(map_table_t *map, const map_table_data_t *data, const double *psi_0_Wb, const char **error)
{
    *error = NULL;
    if (data->count_theta < 2) {
        *error = "psi_0 needs angles: its mean over a turn is nothing";
        return false;
    }
    size_t samples = (size_t)data->count_d * (size_t)data->count_q * (size_t)data->count_theta;
    for (size_t k = 0; k < samples; k++) {
        if (!isfinite(psi_0_Wb[k])) {
            *error = "a flux is not finite";
            return false;
        }
    }
    nodes_t n = {0};
    map_table_t *zero = surface(map, data);
    map_node_t *nodes =
        zero == NULL
            ? NULL
            : malloc((size_t)zero->layers * (size_t)data->count_d * (size_t)data->count_q * sizeof *nodes);
    bool done = nodes != NULL && allocate(&n, data);
    if (done) {
        for (int layer = 0; layer < zero->layers; layer++) {
            split(data, psi_0_Wb, layer, n.nodes, n.f[0]);
            set_nodes(&n, nodes + (size_t)layer * (size_t)n.nodes);
        }
        map_surface_set_patches(zero, nodes);
        map->zero = zero;
    } else {
        *error = "memory is short";
        free(zero != NULL ? zero->patch : NULL);
        free(zero);
    }
    free(nodes);
    free(n.memory);
    return done;
}

bool map_zero_given(const map_table_t *map)
{
    return map != NULL && map->zero != NULL;
}

void map_zero_eval(const map_table_t *map, dq_t i_A, double theta_e_rad, map_zero_t *zero)
{
    const map_table_t *of = map->zero;
    map_reach_t d = map_axis_reach(&of->d, i_A.d), q = map_axis_reach(&of->q, i_A.q);
    int cell_d = map_axis_cell(&of->d, d.s), cell_q = map_axis_cell(&of->q, q.s);
    double t = map_axis_part(&of->d, cell_d, d.s), u = map_axis_part(&of->q, cell_q, q.s);
    double c[MAP_PATCH], c_theta[MAP_PATCH];
    map_series_t series = map_surface_series(of, theta_e_rad);
    map_surface_sum(of, cell_d, cell_q, &series, c, c_theta);
    map_value_t v = map_surface_value(of, cell_d, cell_q, c, t, u);
    map_value_t by_theta = map_surface_value(of, cell_d, cell_q, c_theta, t, u);
    *zero = (map_zero_t){
        .psi_Wb = v.W,
        .d_H = v.d * d.s1,
        .q_H = v.q * q.s1,
        .dd_H_A = v.dd * d.s1 * d.s1 + v.d * d.s2,
        .dq_H_A = v.dq * d.s1 * q.s1,
        .qq_H_A = v.qq * q.s1 * q.s1 + v.q * q.s2,
        .theta_Wb = by_theta.W,
        .d_theta_H = by_theta.d * d.s1,
        .q_theta_H = by_theta.q * q.s1,
    };
}
