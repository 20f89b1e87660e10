#include "sim_plant/map_surface.h"

#include <math.h>
#include <string.h>

#define TWO_PI         6.28318530717958647693
#define MARGIN         0.25 /* of the range; halved while the tangent is not good there ... */
#define HALVINGS       20
#define MARGIN_TANGENT 0.1  /* ... by this part of the smallest on the grid */
#define CONDITION      1e-7 /* least eigenvalue by the largest that is taken as an inductance */
#define PARTS          6    /* of a cell, between the points where the tangent is checked */

double *map_surface_patch(const map_table_t *map, int cell_d, int cell_q)
{
    int cell = cell_d * (map->q.count - 1) + cell_q;
    return map->patch + (size_t)cell * (size_t)map->layers * MAP_PATCH;
}

map_series_t map_surface_series(const map_table_t *map, double theta_e_rad)
{
    map_series_t s = {{0}};
    if (map->layers > 1) {
        double c1 = cos(map->theta_order * theta_e_rad), s1 = sin(map->theta_order * theta_e_rad);
        s.x[0] = c1;
        s.x[1] = s1;
        for (int k = 2; k < map->layers - 1; k += 2) {
            s.x[k] = c1 * s.x[k - 2] - s1 * s.x[k - 1];
            s.x[k + 1] = s1 * s.x[k - 2] + c1 * s.x[k - 1];
        }
    }
    return s;
}

/* A row of coefficients at a time, so that the sums stay in registers. */
void map_surface_sum(const map_table_t *map, int cell_d, int cell_q, const map_series_t *series,
                     double c[MAP_PATCH], double c_theta[MAP_PATCH])
{
    const double *patch = map_surface_patch(map, cell_d, cell_q);
    for (int row = 0; row < MAP_PATCH; row += 6) {
        double sum[6], sum_theta[6] = {0};
        memcpy(sum, patch + row, sizeof sum);
        for (int layer = 1; layer < map->layers; layer += 2) {
            const double *cosine = patch + layer * MAP_PATCH + row, *sine = cosine + MAP_PATCH;
            double x = series->x[layer - 1], y = series->x[layer];
            int harmonic = layer / 2 + 1;
            double order = map->theta_order * harmonic;
            double x_theta = order * x, y_theta = order * y;
            for (int k = 0; k < 6; k++) {
                sum[k] += x * cosine[k] + y * sine[k];
                sum_theta[k] += x_theta * sine[k] - y_theta * cosine[k];
            }
        }
        memcpy(c + row, sum, sizeof sum);
        memcpy(c_theta + row, sum_theta, sizeof sum_theta);
    }
}

map_value_t map_surface_value(const map_table_t *map, int cell_d, int cell_q, const double c[MAP_PATCH],
                              double t, double u)
{
    double h_d_1_A = 1.0 / (map->d.x_A[cell_d + 1] - map->d.x_A[cell_d]);
    double h_q_1_A = 1.0 / (map->q.x_A[cell_q + 1] - map->q.x_A[cell_q]);
    map_value_t v = map_patch_value(c, t, u);
    v.d *= h_d_1_A;
    v.q *= h_q_1_A;
    v.dd *= h_d_1_A * h_d_1_A;
    v.dq *= h_d_1_A * h_q_1_A;
    v.qq *= h_q_1_A * h_q_1_A;
    return v;
}

static int between(int k, int low, int high)
{
    return k < low ? low : k > high ? high : k;
}

/* The node of the grid nearest to a node with margin, moved out to it. */
static map_node_t node_with_margin(const map_table_t *map, const map_node_t *nodes, int i, int j)
{
    int near_i = between(i, 1, map->d.count - 2), near_j = between(j, 1, map->q.count - 2);
    const map_node_t *node = &nodes[(near_i - 1) * (map->q.count - 2) + near_j - 1];
    if (i == near_i && j == near_j) {
        return *node;
    }
    return map_patch_extend(node, map->d.x_A[i] - map->d.x_A[near_i], map->q.x_A[j] - map->q.x_A[near_j]);
}

void map_surface_set_patches(map_table_t *map, const map_node_t *nodes)
{
    int grid_nodes = (map->d.count - 2) * (map->q.count - 2);
    for (int i = 0; i + 1 < map->d.count; i++) {
        for (int j = 0; j + 1 < map->q.count; j++) {
            for (int layer = 0; layer < map->layers; layer++) {
                const map_node_t *of_layer = nodes + layer * grid_nodes;
                map_node_t corner[4];
                for (int k = 0; k < 4; k++) {
                    corner[k] = node_with_margin(map, of_layer, i + k / 2, j + k % 2);
                }
                map_patch_set(map_surface_patch(map, i, j) + layer * MAP_PATCH, corner,
                              map->d.x_A[i + 1] - map->d.x_A[i], map->q.x_A[j + 1] - map->q.x_A[j]);
            }
        }
    }
}

/* Extremes over some cells and a turn of the angle. */
typedef struct {
    double tangent_H[2]; /* least and largest eigenvalue */
    double psi_d_Wb[2], psi_q_Wb[2];
} extremes_t;

static const extremes_t nothing_found = {{HUGE_VAL, -HUGE_VAL}, {HUGE_VAL, -HUGE_VAL}, {HUGE_VAL, -HUGE_VAL}};

/* Cells from one to another, without the last. */
typedef struct {
    int d, d_end, q, q_end;
} cells_t;

static void widen(double range[2], double low, double high)
{
    range[0] = fmin(range[0], low);
    range[1] = fmax(range[1], high);
}

static void search_cell(const map_table_t *map, int cell_d, int cell_q, const map_series_t *series,
                        extremes_t *found)
{
    double c[MAP_PATCH], c_theta[MAP_PATCH];
    map_surface_sum(map, cell_d, cell_q, series, c, c_theta);
    for (int i = 0; i <= PARTS; i++) {
        for (int j = 0; j <= PARTS; j++) {
            map_value_t v = map_surface_value(map, cell_d, cell_q, c, (double)i / PARTS, (double)j / PARTS);
            double mean = 0.5 * (v.dd + v.qq), radius = hypot(0.5 * (v.dd - v.qq), v.dq);
            double least = isfinite(mean - radius) ? mean - radius : -HUGE_VAL; /* absurd data overflow */
            widen(found->tangent_H, least, mean + radius);
            widen(found->psi_d_Wb, v.d, v.d);
            widen(found->psi_q_Wb, v.q, v.q);
        }
    }
}

static extremes_t search(const map_table_t *map, cells_t cells)
{
    extremes_t found = nothing_found;
    int angles = map->layers; /* two of each wave of the highest harmonic */
    for (int k = 0; k < angles; k++) {
        map_series_t series = map_surface_series(map, TWO_PI * k / (angles * map->theta_order));
        for (int i = cells.d; i < cells.d_end; i++) {
            for (int j = cells.q; j < cells.q_end; j++) {
                search_cell(map, i, j, &series, &found);
            }
        }
    }
    return found;
}

/* The margin: below and above along i_d, with the corners, then along i_q. */
static void margin_cells(const map_table_t *map, cells_t side[4])
{
    int d = map->d.count - 1, q = map->q.count - 1;
    side[0] = (cells_t){0, 1, 0, q};
    side[1] = (cells_t){d - 1, d, 0, q};
    side[2] = (cells_t){0, d, 0, 1};
    side[3] = (cells_t){0, d, q - 1, q};
}

/* What the fluxes come to far from the data: bounds of map_axis.h. */
static bool set_ends(map_table_t *map, double least_H)
{
    cells_t side[4];
    margin_cells(map, side);
    bool good = true;
    for (int k = 0; k < 2; k++) {
        extremes_t along_d = search(map, side[k]), along_q = search(map, side[2 + k]);
        map->d.psi_end_Wb[k] = along_d.psi_d_Wb[k];
        map->q.psi_end_Wb[k] = along_q.psi_q_Wb[k];
        good = good && along_d.tangent_H[0] > least_H && along_q.tangent_H[0] > least_H;
    }
    return good;
}

/* Inductances far from the data: mean over the edge of the grid. */
static void set_end_inductances(map_table_t *map, const map_node_t *nodes)
{
    int n = map->d.count - 2, m = map->q.count - 2;
    for (int k = 0; k < 2; k++) {
        double sum_d = 0.0, sum_q = 0.0;
        for (int j = 0; j < m; j++) {
            sum_d += nodes[k * (n - 1) * m + j].dd;
        }
        for (int i = 0; i < n; i++) {
            sum_q += nodes[i * m + k * (m - 1)].qq;
        }
        map->d.L_end_H[k] = sum_d / m;
        map->q.L_end_H[k] = sum_q / n;
    }
}

/* W' = 0 at zero current, whatever the angle. */
static void set_zero(map_table_t *map)
{
    map_reach_t d = map_axis_reach(&map->d, 0.0), q = map_axis_reach(&map->q, 0.0);
    int cell_d = map_axis_cell(&map->d, d.s), cell_q = map_axis_cell(&map->q, q.s);
    double zero[MAP_LAYERS];
    for (int layer = 0; layer < map->layers; layer++) {
        zero[layer] =
            map_patch_value(map_surface_patch(map, cell_d, cell_q) + layer * MAP_PATCH,
                            map_axis_part(&map->d, cell_d, d.s), map_axis_part(&map->q, cell_q, q.s))
                .W;
    }
    zero[0] += d.g + q.g;
    int cells = (map->d.count - 1) * (map->q.count - 1);
    for (int k = 0; k < cells * map->layers; k++) {
        map->patch[(size_t)k * MAP_PATCH] -= zero[k % map->layers];
    }
}

bool map_surface_build(map_table_t *map, const map_node_t *nodes, double *L_min_H)
{
    double width_d_A = MARGIN * (map->d.high_A - map->d.low_A);
    double width_q_A = MARGIN * (map->q.high_A - map->q.low_A);
    map_axis_set_margin(&map->d, width_d_A);
    map_axis_set_margin(&map->q, width_q_A);
    map_surface_set_patches(map, nodes);
    extremes_t grid = search(map, (cells_t){1, map->d.count - 2, 1, map->q.count - 2});
    *L_min_H = grid.tangent_H[0];
    bool good = grid.tangent_H[0] > CONDITION * grid.tangent_H[1];
    for (int k = 0; good && !set_ends(map, MARGIN_TANGENT * *L_min_H); k++) {
        good = k < HALVINGS;
        width_d_A *= 0.5;
        width_q_A *= 0.5;
        map_axis_set_margin(&map->d, width_d_A);
        map_axis_set_margin(&map->q, width_q_A);
        map_surface_set_patches(map, nodes);
    }
    set_end_inductances(map, nodes);
    set_zero(map);
    return good;
}
