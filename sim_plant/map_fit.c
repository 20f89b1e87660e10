#include "sim_plant/map_fit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim_plant/map_slope.h"

#define PASSES       12    /* of moving the fluxes: what is left then alternates from node to node */
#define CG_TOLERANCE 1e-15 /* of the residual */

/* From one node to the next. */
typedef struct {
    int a, b;
    double h_A;
    double weight; /* width of the cells beside it over h */
    double rise;   /* of W'/1.5, by the cubic of the flux */
} edge_t;

typedef struct {
    const map_grid_t *grid;
    bool limit;
    int nodes, edges_d, edges;
    edge_t *edge; /* those along d first */
    map_line_t along_d, along_q;
    double *psi_d, *psi_q, *given_d, *given_q;
    double *W, *dd, *dq, *qq, *ddq, *dqq, *ddqq;
    double *diagonal, *residual, *direction, *image; /* of the conjugate gradients */
    double *work;
    double *memory; /* of all these */
} fit_t;

static void slopes_d(const fit_t *fit, const double *f, double *slope)
{
    for (int j = 0; j < fit->grid->count_q; j++) {
        map_slope_spline(&fit->along_d, f + j, slope + j, fit->work);
    }
}

static void slopes_q(const fit_t *fit, const double *f, double *slope)
{
    for (int k = 0; k < fit->nodes; k += fit->grid->count_q) {
        map_slope_spline(&fit->along_q, f + k, slope + k, fit->work);
    }
}

/* Width of the area that belongs to node i of a grid. */
static double width(const double *x, int count, int i)
{
    return 0.5 * (x[i < count - 1 ? i + 1 : i] - x[i > 0 ? i - 1 : i]);
}

static void set_edges(fit_t *fit)
{
    const map_grid_t *g = fit->grid;
    edge_t *edge = fit->edge;
    for (int i = 0; i + 1 < g->count_d; i++) {
        for (int j = 0; j < g->count_q; j++) {
            int a = i * g->count_q + j;
            double h = g->i_d_A[i + 1] - g->i_d_A[i];
            *edge++ = (edge_t){a, a + g->count_q, h, width(g->i_q_A, g->count_q, j) / h, 0.0};
        }
    }
    for (int i = 0; i < g->count_d; i++) {
        for (int j = 0; j + 1 < g->count_q; j++) {
            int a = i * g->count_q + j;
            double h = g->i_q_A[j + 1] - g->i_q_A[j];
            *edge++ = (edge_t){a, a + 1, h, width(g->i_d_A, g->count_d, i) / h, 0.0};
        }
    }
}

/* Slopes of the fluxes over their own currents and the increments they make. */
static void set_rises(fit_t *fit)
{
    slopes_d(fit, fit->psi_d, fit->dd);
    slopes_q(fit, fit->psi_q, fit->qq);
    for (int j = 0; fit->limit && j < fit->grid->count_q; j++) {
        map_slope_limit_own(&fit->along_d, fit->psi_d + j, fit->dd + j);
    }
    for (int k = 0; fit->limit && k < fit->nodes; k += fit->grid->count_q) {
        map_slope_limit_own(&fit->along_q, fit->psi_q + k, fit->qq + k);
    }
    for (int k = 0; k < fit->edges; k++) {
        edge_t *e = &fit->edge[k];
        const double *psi = k < fit->edges_d ? fit->psi_d : fit->psi_q;
        const double *slope = k < fit->edges_d ? fit->dd : fit->qq;
        e->rise = e->h_A * (0.5 * (psi[e->a] + psi[e->b]) + e->h_A / 12.0 * (slope[e->a] - slope[e->b]));
    }
}

/* Adds the weighted difference of both ends of every edge, less its rise when asked for. */
static void balance(const fit_t *fit, const double *W, bool less_rise, double *sum)
{
    memset(sum, 0, (size_t)fit->nodes * sizeof *sum);
    for (int k = 0; k < fit->edges; k++) {
        const edge_t *e = &fit->edge[k];
        double flow = e->weight * (W[e->b] - W[e->a] - (less_rise ? e->rise : 0.0));
        sum[e->b] += flow;
        sum[e->a] -= flow;
    }
}

/* W' by conjugate gradients, preconditioned by the diagonal; W holds where to begin. */
static void solve_coenergy(fit_t *fit)
{
    double *r = fit->residual, *p = fit->direction, *Ap = fit->image;
    balance(fit, fit->W, true, r);
    double rho = 0.0, rho_end = 0.0;
    for (int k = 0; k < fit->nodes; k++) {
        r[k] = -r[k];
        p[k] = r[k] / fit->diagonal[k];
        rho += r[k] * p[k];
        rho_end += fit->diagonal[k] * fit->W[k] * fit->W[k];
    }
    rho_end = CG_TOLERANCE * CG_TOLERANCE * (rho + rho_end);
    for (int step = 0; step < fit->nodes && rho > rho_end; step++) {
        balance(fit, p, false, Ap);
        double curvature = 0.0, rho_next = 0.0;
        for (int k = 0; k < fit->nodes; k++) {
            curvature += p[k] * Ap[k];
        }
        double length = rho / curvature;
        for (int k = 0; k < fit->nodes; k++) {
            fit->W[k] += length * p[k];
            r[k] -= length * Ap[k];
            rho_next += r[k] * r[k] / fit->diagonal[k];
        }
        for (int k = 0; k < fit->nodes; k++) {
            p[k] = r[k] / fit->diagonal[k] + rho_next / rho * p[k];
        }
        rho = rho_next;
    }
}

/* Moves each flux by what the edges beside it lack, weighted by length: steepest descent, which leaves alone
 * what the edges do not see. */
static void move_fluxes(fit_t *fit)
{
    for (int along = 0; along < 2; along++) {
        double *psi = along == 0 ? fit->psi_d : fit->psi_q;
        double *lack = fit->residual, *length = fit->image;
        memset(lack, 0, (size_t)fit->nodes * sizeof *lack);
        memset(length, 0, (size_t)fit->nodes * sizeof *length);
        for (int k = along == 0 ? 0 : fit->edges_d; k < (along == 0 ? fit->edges_d : fit->edges); k++) {
            const edge_t *e = &fit->edge[k];
            double missing = fit->W[e->b] - fit->W[e->a] - e->rise;
            lack[e->a] += missing;
            lack[e->b] += missing;
            length[e->a] += e->h_A;
            length[e->b] += e->h_A;
        }
        for (int k = 0; k < fit->nodes; k++) {
            psi[k] += lack[k] / length[k];
        }
    }
}

/* Deviation from reciprocity of the data as they are, by splines without limits. */
static void report_deviation(const fit_t *fit, map_fit_report_t *report)
{
    double *dq = fit->dq, *qd = fit->image;
    slopes_q(fit, fit->psi_d, dq);
    slopes_d(fit, fit->psi_q, qd);
    slopes_d(fit, fit->psi_d, fit->dd);
    slopes_q(fit, fit->psi_q, fit->qq);
    report->cross_H2 = report->self_H2 = 0.0;
    for (int k = 0; k < fit->nodes; k++) {
        report->cross_H2 += (dq[k] - qd[k]) * (dq[k] - qd[k]);
        report->self_H2 += 0.5 * (fit->dd[k] * fit->dd[k] + fit->qq[k] * fit->qq[k]);
    }
}

static double largest_move(const fit_t *fit)
{
    double moved = 0.0;
    for (int k = 0; k < fit->nodes; k++) {
        moved = fmax(moved, fabs(fit->psi_d[k] - fit->given_d[k]));
        moved = fmax(moved, fabs(fit->psi_q[k] - fit->given_q[k]));
    }
    return moved;
}

static void symmetrise(fit_t *fit)
{
    memcpy(fit->given_d, fit->psi_d, (size_t)fit->nodes * sizeof *fit->psi_d);
    memcpy(fit->given_q, fit->psi_q, (size_t)fit->nodes * sizeof *fit->psi_q);
    memset(fit->diagonal, 0, (size_t)fit->nodes * sizeof *fit->diagonal);
    for (int k = 0; k < fit->edges; k++) {
        fit->diagonal[fit->edge[k].a] += fit->edge[k].weight;
        fit->diagonal[fit->edge[k].b] += fit->edge[k].weight;
    }
    set_rises(fit);
    solve_coenergy(fit);
    for (int pass = 0; pass < PASSES; pass++) {
        move_fluxes(fit);
        set_rises(fit);
        solve_coenergy(fit);
    }
}

/* A cross derivative is the slope over i_q of one lower derivative and over i_d of another: their mean. */
static void mean_slopes(const fit_t *fit, const double *over_q, const double *over_d, double *mean)
{
    slopes_q(fit, over_q, mean);
    slopes_d(fit, over_d, fit->image);
    for (int k = 0; k < fit->nodes; k++) {
        mean[k] = 0.5 * (mean[k] + fit->image[k]);
    }
}

static void limit_cross_slopes(const fit_t *fit)
{
    for (int k = 0; fit->limit && k < fit->nodes; k += fit->grid->count_q) {
        map_slope_limit_cross(&fit->along_q, fit->psi_d + k, fit->dq + k);
    }
    for (int j = 0; fit->limit && j < fit->grid->count_q; j++) {
        map_slope_limit_cross(&fit->along_d, fit->psi_q + j, fit->dq + j);
    }
}

static void limit_cross_curvatures(const fit_t *fit)
{
    for (int k = 0; fit->limit && k < fit->nodes; k += fit->grid->count_q) {
        map_slope_limit_curvature(&fit->along_q, fit->psi_d + k, fit->dq + k, fit->dqq + k);
    }
    for (int j = 0; fit->limit && j < fit->grid->count_q; j++) {
        map_slope_limit_curvature(&fit->along_d, fit->psi_q + j, fit->dq + j, fit->ddq + j);
    }
}

static void set_nodes(const fit_t *fit, map_node_t *nodes)
{
    mean_slopes(fit, fit->psi_d, fit->psi_q, fit->dq);
    limit_cross_slopes(fit);
    mean_slopes(fit, fit->dd, fit->dq, fit->ddq);
    mean_slopes(fit, fit->dq, fit->qq, fit->dqq);
    limit_cross_curvatures(fit);
    mean_slopes(fit, fit->ddq, fit->dqq, fit->ddqq);
    for (int k = 0; k < fit->nodes; k++) {
        nodes[k] = (map_node_t){fit->W[k],  fit->psi_d[k], fit->psi_q[k], fit->dd[k],  fit->dq[k],
                                fit->qq[k], fit->ddq[k],   fit->dqq[k],   fit->ddqq[k]};
    }
}

static bool allocate(fit_t *fit)
{
    double **arrays[] = {&fit->W,        &fit->dd,        &fit->qq,      &fit->dq,      &fit->ddq,
                         &fit->dqq,      &fit->ddqq,      &fit->given_d, &fit->given_q, &fit->diagonal,
                         &fit->residual, &fit->direction, &fit->image,   &fit->work};
    size_t count = sizeof arrays / sizeof arrays[0];
    fit->edge = malloc((size_t)fit->edges * sizeof *fit->edge);
    fit->memory = calloc(count * (size_t)fit->nodes, sizeof *fit->memory);
    for (size_t k = 0; k < count && fit->memory != NULL; k++) {
        *arrays[k] = fit->memory + k * (size_t)fit->nodes;
    }
    return fit->edge != NULL && fit->memory != NULL;
}

bool map_fit_nodes(const map_grid_t *grid, bool limit, double *psi_d_Wb, double *psi_q_Wb, map_node_t *nodes,
                   map_fit_report_t *report)
{
    int n = grid->count_d, m = grid->count_q;
    fit_t fit = {
        .grid = grid,
        .limit = limit,
        .nodes = n * m,
        .edges_d = (n - 1) * m,
        .edges = (n - 1) * m + n * (m - 1),
        .along_d = {n, m, grid->i_d_A},
        .along_q = {m, 1, grid->i_q_A},
    };
    fit.psi_d = psi_d_Wb;
    fit.psi_q = psi_q_Wb;
    bool allocated = allocate(&fit);
    if (allocated) {
        set_edges(&fit);
        report_deviation(&fit, report);
        symmetrise(&fit);
        report->moved_Wb = largest_move(&fit);
        set_nodes(&fit, nodes);
    }
    free(fit.edge);
    free(fit.memory);
    return allocated;
}
