#include "sim_plant/map_slope.h"

#include <math.h>
#include <stdbool.h>

/* Of a flux over its own current, times the smaller secant next to the node. Up to 3 a cubic stays monotone
 * (Fritsch and Carlson), but flat in places; within these limits it keeps a slope. */
#define OWN_LEAST 0.2
#define OWN_MOST  2.5

/* Of a flux over the other current, times the smaller secant and their mean: then there is a curvature that
 * keeps the quintics on both sides monotone. */
#define CROSS_MOST 2.5
#define CROSS_MEAN 1.25

#define QUINTIC_CHECKS 8 /* points of a quintic where its slope is looked at */
#define SWEEPS         4 /* a node that is limited may disturb the stretch on its other side */

static double secant(const map_line_t *line, const double *f, int i)
{
    return (f[(i + 1) * line->stride] - f[i * line->stride]) / (line->x[i + 1] - line->x[i]);
}

void map_slope_spline(const map_line_t *line, const double *f, double *slope, double *work)
{
    const double *x = line->x;
    int last = line->count - 1, stride = line->stride;
    double h0 = x[1] - x[0], h1 = x[2] - x[1];
    work[0] = (h0 + h1) / h1; /* above the diagonal */
    slope[0] = ((3.0 * h0 + 2.0 * h1) * secant(line, f, 0) + h0 * h0 / h1 * secant(line, f, 1)) / (h0 + h1);
    for (int i = 1; i < last; i++) {
        h0 = x[i] - x[i - 1];
        h1 = x[i + 1] - x[i];
        double pivot = 2.0 * (h0 + h1) - h1 * work[i - 1];
        double right = 3.0 * (h1 * secant(line, f, i - 1) + h0 * secant(line, f, i));
        work[i] = h0 / pivot;
        slope[i * stride] = (right - h1 * slope[(i - 1) * stride]) / pivot;
    }
    h0 = x[last - 1] - x[last - 2];
    h1 = x[last] - x[last - 1];
    double right =
        (h1 * h1 * secant(line, f, last - 2) + (3.0 * h1 + 2.0 * h0) * h0 * secant(line, f, last - 1)) /
        (h0 + h1);
    double pivot = h0 - (h0 + h1) * work[last - 1];
    slope[last * stride] = (right - (h0 + h1) * slope[(last - 1) * stride]) / pivot;
    for (int i = last - 1; i >= 0; i--) {
        slope[i * stride] -= work[i] * slope[(i + 1) * stride];
    }
}

/* Where the flux does not rise the map is refused later: nothing to do here. */
void map_slope_limit_own(const map_line_t *line, const double *f, double *slope)
{
    int last = line->count - 1;
    for (int i = 0; i <= last; i++) {
        double least = fmin(secant(line, f, i > 0 ? i - 1 : 0), secant(line, f, i < last ? i : last - 1));
        double *s = &slope[i * line->stride];
        if (least > 0.0) {
            *s = fmin(fmax(*s, OWN_LEAST * least), OWN_MOST * least);
        }
    }
}

/* The secants beside a node and its distances to both neighbours. At an end of the line the one there is
 * stands for both. */
typedef struct {
    double
        sign; /* of the stretch of two steps to either side; 0: not monotone. An extremum nearby means that */
    double below, above; /* the smallest secant says nothing about the slope. */
    double h_below, h_above;
} stretch_t;

static stretch_t stretch_at(const map_line_t *line, const double *f, int i)
{
    int last = line->count - 1, below = i > 0 ? i - 1 : 0, above = i < last ? i : last - 1;
    stretch_t s = {0.0, secant(line, f, below), secant(line, f, above), line->x[below + 1] - line->x[below],
                   line->x[above + 1] - line->x[above]};
    double least = HUGE_VAL, most = -HUGE_VAL;
    for (int k = i > 1 ? i - 2 : 0; k <= i + 1 && k < last; k++) {
        least = fmin(least, secant(line, f, k));
        most = fmax(most, secant(line, f, k));
    }
    s.sign = least > 0.0 ? 1.0 : most < 0.0 ? -1.0 : 0.0;
    s.below *= s.sign;
    s.above *= s.sign;
    return s;
}

void map_slope_limit_cross(const map_line_t *line, const double *f, double *slope)
{
    for (int i = 0; i < line->count; i++) {
        stretch_t s = stretch_at(line, f, i);
        if (s.sign != 0.0) {
            double mean = (s.below * s.h_above + s.above * s.h_below) / (s.h_below + s.h_above);
            double most = fmin(CROSS_MOST * fmin(s.below, s.above), CROSS_MEAN * mean);
            slope[i * line->stride] = s.sign * fmin(fmax(s.sign * slope[i * line->stride], 0.0), most);
        }
    }
}

static double curvature_in_limits(const stretch_t *s, double slope, double curvature)
{
    double rise = s->sign * slope;
    double least = fmax(-4.0 * rise / s->h_above, -(10.0 * s->below - 8.0 * rise) / s->h_below);
    double most = fmin(4.0 * rise / s->h_below, (10.0 * s->above - 8.0 * rise) / s->h_above);
    return s->sign * fmin(fmax(s->sign * curvature, least), most);
}

/* Least slope between two nodes, relative to the secant, of the quintic with these end slopes and curvatures
 * (relative too). Its derivative has the Bernstein coefficients a, a + A/4, 5 - 2 (a + b) - (A - B)/4,
 * b - B/4, b: positive where they are, which is what curvature_in_limits() sees to. */
static double least_slope(double a, double b, double A, double B)
{
    double c1 = 4.0 * a + A, c2 = 30.0 - 12.0 * (a + b) - 1.5 * (A - B), c3 = 4.0 * b - B;
    double least = fmin(a, b);
    for (int k = 1; k < QUINTIC_CHECKS; k++) {
        double t = (double)k / QUINTIC_CHECKS, r = 1.0 - t;
        least = fmin(least, r * r * r * (r * a + t * c1) + t * t * (r * r * c2 + t * (r * c3 + t * b)));
    }
    return least;
}

static bool swings(const map_line_t *line, const double *f, const double *slope, const double *curvature,
                   int i)
{
    int k = i * line->stride, next = k + line->stride;
    double h = line->x[i + 1] - line->x[i], rise = secant(line, f, i);
    return least_slope(slope[k] / rise, slope[next] / rise, h * curvature[k] / rise,
                       h * curvature[next] / rise) < 0.0;
}

void map_slope_limit_curvature(const map_line_t *line, const double *f, const double *slope,
                               double *curvature)
{
    for (int sweep = 0; sweep < SWEEPS; sweep++) {
        for (int i = 0; i + 1 < line->count; i++) {
            stretch_t here = stretch_at(line, f, i), next = stretch_at(line, f, i + 1);
            if (here.sign * next.sign > 0.0 && swings(line, f, slope, curvature, i)) {
                double *c = &curvature[i * line->stride], *c_next = c + line->stride;
                *c = curvature_in_limits(&here, slope[i * line->stride], *c);
                *c_next = curvature_in_limits(&next, slope[(i + 1) * line->stride], *c_next);
            }
        }
    }
}
