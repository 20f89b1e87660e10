#include "sim_plant/map_table.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim_plant/map_fit.h"
#include "sim_plant/map_surface.h"

#define THREE_HALVES 1.5
#define TWO_PI       6.28318530717958647693
#define NODES_LEAST  4
#define NODES_MOST   4096      /* of one axis, and in all: */
#define SAMPLES_MOST 100000000 /* what an int can count, with every product of counts made here */

static const char short_of_memory[] = "memory is short";

void map_table_eval(const map_table_t *map, dq_t i_A, double theta_e_rad, map_point_t *point)
{
    map_reach_t d = map_axis_reach(&map->d, i_A.d), q = map_axis_reach(&map->q, i_A.q);
    int cell_d = map_axis_cell(&map->d, d.s), cell_q = map_axis_cell(&map->q, q.s);
    double t = map_axis_part(&map->d, cell_d, d.s), u = map_axis_part(&map->q, cell_q, q.s);
    const double *patch = map_surface_patch(map, cell_d, cell_q);
    double c[MAP_PATCH], c_theta[MAP_PATCH];
    map_value_t theta = {0};
    if (map->layers > 1) {
        map_series_t series = map_surface_series(map, theta_e_rad);
        map_surface_sum(map, cell_d, cell_q, &series, c, c_theta);
        theta = map_surface_value(map, cell_d, cell_q, c_theta, t, u);
        patch = c;
    }
    map_value_t v = map_surface_value(map, cell_d, cell_q, patch, t, u);
    *point = (map_point_t){
        .psi_Wb = {v.d * d.s1 + d.g1, v.q * q.s1 + q.g1},
        .L_d_H = v.dd * d.s1 * d.s1 + v.d * d.s2 + d.g2,
        .L_dq_H = v.dq * d.s1 * q.s1,
        .L_q_H = v.qq * q.s1 * q.s1 + v.q * q.s2 + q.g2,
        .psi_theta_Wb = {theta.d * d.s1, theta.q * q.s1},
        .coenergy_J = THREE_HALVES * (v.W + d.g + q.g),
        .coenergy_theta_J = THREE_HALVES * theta.W,
    };
}

static bool ascends(const double *x, int count)
{
    for (int k = 1; k < count; k++) {
        if (!(x[k] > x[k - 1])) {
            return false;
        }
    }
    return true;
}

static bool all_finite(const double *x, size_t count)
{
    for (size_t k = 0; k < count; k++) {
        if (!isfinite(x[k])) {
            return false;
        }
    }
    return true;
}

static const char *grid_error(const map_grid_t *grid)
{
    if (grid->count_d < NODES_LEAST || grid->count_q < NODES_LEAST) {
        return "a flux map needs at least 4 values of i_d and of i_q";
    }
    if (grid->count_d > NODES_MOST || grid->count_q > NODES_MOST) {
        return "a flux map has at most 4096 values of i_d or i_q";
    }
    if (!all_finite(grid->i_d_A, (size_t)grid->count_d) || !all_finite(grid->i_q_A, (size_t)grid->count_q)) {
        return "a current of the grid is not finite";
    }
    if (!ascends(grid->i_d_A, grid->count_d) || !ascends(grid->i_q_A, grid->count_q)) {
        return "the currents of the grid do not ascend";
    }
    return NULL;
}

void map_table_destroy(map_table_t *map)
{
    if (map != NULL) {
        if (map->zero != NULL) {
            free(map->zero->patch);
            free(map->zero);
        }
        map_axis_free(&map->d);
        map_axis_free(&map->q);
        free(map->patch);
        free(map);
    }
}

static map_table_t *allocate(const map_grid_t *grid, int layers, int theta_order)
{
    map_table_t *map = calloc(1, sizeof *map);
    if (map == NULL) {
        return NULL;
    }
    map->layers = layers;
    map->theta_order = theta_order;
    size_t cells = (size_t)(grid->count_d + 1) * (size_t)(grid->count_q + 1);
    map->patch = malloc(cells * (size_t)layers * MAP_PATCH * sizeof *map->patch);
    if (!map_axis_init(&map->d, grid->count_d, grid->i_d_A) ||
        !map_axis_init(&map->q, grid->count_q, grid->i_q_A) || map->patch == NULL) {
        map_table_destroy(map);
        return NULL;
    }
    return map;
}

static map_table_t *build(const map_grid_t *grid, int layers, int theta_order, const map_node_t *nodes,
                          map_table_report_t *report, const char **error)
{
    map_table_t *map = allocate(grid, layers, theta_order);
    if (map == NULL) {
        *error = short_of_memory;
        return NULL;
    }
    if (!map_surface_build(map, nodes, &report->L_min_H)) {
        *error = "the tangent inductance is not positive definite: each flux must rise with its own current, "
                 "and a sharp knee needs a fine grid";
        map_table_destroy(map);
        return NULL;
    }
    return map;
}

map_table_t *map_table_from_nodes(int count_d, int count_q, const double *i_d_A, const double *i_q_A,
                                  const map_node_t *nodes, map_table_report_t *report, const char **error)
{
    map_grid_t grid = {count_d, count_q, i_d_A, i_q_A};
    *report = (map_table_report_t){0};
    *error = grid_error(&grid);
    for (int k = 0; *error == NULL && k < count_d * count_q; k++) {
        const map_node_t *n = &nodes[k];
        if (!isfinite(n->W + n->d + n->q + n->dd + n->dq + n->qq + n->ddq + n->dqq + n->ddqq)) {
            *error = "a value of a node is not finite";
        }
    }
    return *error == NULL ? build(&grid, 1, 1, nodes, report, error) : NULL;
}

static int angles(const map_table_data_t *data)
{
    return data->count_theta > 1 ? data->count_theta : 1;
}

/* Of an even number of angles the highest harmonic has no sine: it is not used. */
static int layers_of(const map_table_data_t *data)
{
    int harmonics = (angles(data) - 1) / 2;
    return 1 + 2 * (harmonics < MAP_HARMONICS ? harmonics : MAP_HARMONICS);
}

/* The waves of all layers at the angles of the data, and the fluxes they are the series of. */
typedef struct {
    int layers, count, nodes;
    double *wave;          /* [layer][angle] */
    double *psi_d, *psi_q; /* [layer][node] */
    map_node_t *node;      /* [layer][node] */
} split_t;

static void free_split(split_t *split)
{
    free(split->wave);
    free(split->psi_d);
    free(split->psi_q);
    free(split->node);
}

static bool allocate_split(split_t *split)
{
    size_t values = (size_t)split->layers * (size_t)split->nodes;
    split->wave = malloc((size_t)split->layers * (size_t)split->count * sizeof *split->wave);
    split->psi_d = malloc(values * sizeof *split->psi_d);
    split->psi_q = malloc(values * sizeof *split->psi_q);
    split->node = malloc(values * sizeof *split->node);
    return split->wave != NULL && split->psi_d != NULL && split->psi_q != NULL && split->node != NULL;
}

static void set_waves(split_t *split)
{
    for (int layer = 0; layer < split->layers; layer++) {
        for (int n = 0; n < split->count; n++) {
            double x = TWO_PI * (n * ((layer + 1) / 2) % split->count) / split->count;
            split->wave[layer * split->count + n] = layer % 2 == 1 || layer == 0 ? cos(x) : sin(x);
        }
    }
}

static void split_flux(const split_t *split, const double *samples, double *psi)
{
    for (int layer = 0; layer < split->layers; layer++) {
        const double *wave = split->wave + layer * split->count;
        for (int k = 0; k < split->nodes; k++) {
            double sum = 0.0;
            for (int n = 0; n < split->count; n++) {
                sum += samples[k * split->count + n] * wave[n];
            }
            psi[layer * split->nodes + k] = (layer == 0 ? 1.0 : 2.0) * sum / split->count;
        }
    }
}

/* Largest difference of the samples from their series. */
static double neglected_Wb(const split_t *split, const double *samples, const double *psi)
{
    double largest = 0.0;
    for (int k = 0; k < split->nodes * split->count; k++) {
        double sum = 0.0;
        for (int layer = 0; layer < split->layers; layer++) {
            sum += split->wave[layer * split->count + k % split->count] *
                   psi[layer * split->nodes + k / split->count];
        }
        largest = fmax(largest, fabs(samples[k] - sum));
    }
    return split->count > 1 ? largest : 0.0;
}

static bool fit_layers(const map_grid_t *grid, const split_t *split, map_table_report_t *report)
{
    double cross_H2 = 0.0, self_H2 = 0.0;
    for (int layer = 0; layer < split->layers; layer++) {
        map_fit_report_t of_layer;
        int first = layer * split->nodes;
        if (!map_fit_nodes(grid, layer == 0, split->psi_d + first, split->psi_q + first, split->node + first,
                           &of_layer)) {
            return false;
        }
        cross_H2 += (layer == 0 ? 1.0 : 0.5) * of_layer.cross_H2;
        self_H2 += (layer == 0 ? 1.0 : 0.5) * of_layer.self_H2;
        report->moved_Wb += of_layer.moved_Wb;
    }
    report->reciprocity = sqrt(cross_H2 / self_H2);
    return true;
}

static const char *data_error(const map_table_data_t *data, const map_grid_t *grid)
{
    const char *error = grid_error(grid);
    if (error != NULL) {
        return error;
    }
    if (data->count_theta < 0 || data->count_theta > NODES_MOST ||
        (data->count_theta > 1 && (data->theta_order < 1 || data->theta_order > NODES_MOST))) {
        return "the number of angles or of their periods makes no sense";
    }
    size_t samples = (size_t)data->count_d * (size_t)data->count_q * (size_t)angles(data);
    if (samples > SAMPLES_MOST) {
        return "the flux map has more than 1e8 values";
    }
    if (!all_finite(data->psi_d_Wb, samples) || !all_finite(data->psi_q_Wb, samples)) {
        return "a flux is not finite";
    }
    return NULL;
}

map_table_t *map_table_create(const map_table_data_t *data, map_table_report_t *report, const char **error)
{
    map_grid_t grid = {data->count_d, data->count_q, data->i_d_A, data->i_q_A};
    *report = (map_table_report_t){0};
    *error = data_error(data, &grid);
    if (*error != NULL) {
        return NULL;
    }
    split_t split = {.layers = layers_of(data), .count = angles(data), .nodes = grid.count_d * grid.count_q};
    map_table_t *map = NULL;
    *error = short_of_memory;
    if (allocate_split(&split)) {
        set_waves(&split);
        split_flux(&split, data->psi_d_Wb, split.psi_d);
        split_flux(&split, data->psi_q_Wb, split.psi_q);
        report->neglected_Wb = fmax(neglected_Wb(&split, data->psi_d_Wb, split.psi_d),
                                    neglected_Wb(&split, data->psi_q_Wb, split.psi_q));
        if (fit_layers(&grid, &split, report)) {
            *error = NULL;
            map = build(&grid, split.layers, data->count_theta > 1 ? data->theta_order : 1, split.node,
                        report, error);
        }
    }
    free_split(&split);
    return map;
}
