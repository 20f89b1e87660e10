/* Slopes of node values along a grid line, for map_fit.c: the C2 cubic spline, and limits that keep the flux
 * monotone where the values are.
 *
 * Values of a line stand `stride` apart; x ascends; at least 4 nodes. */
#ifndef PLANT_MAP_SLOPE_H
#define PLANT_MAP_SLOPE_H

typedef struct {
    int count, stride;
    const double *x;
} map_line_t;

/* Not-a-knot spline; work: count values. */
void map_slope_spline(const map_line_t *line, const double *f, double *slope, double *work);

/* A flux over its own current: between two nodes where it rises, the slope of its cubic is nowhere less than
 * a fifth of the secant. */
void map_slope_limit_own(const map_line_t *line, const double *f, double *slope);

/* A flux over the other current, a quintic: no overshoot where it is monotone two steps to either side. First
 * its slopes, then its curvatures. */
void map_slope_limit_cross(const map_line_t *line, const double *f, double *slope);
void map_slope_limit_curvature(const map_line_t *line, const double *f, const double *slope,
                               double *curvature);

#endif
