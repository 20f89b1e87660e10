#include "sim_plant/map_patch.h"

/* Derivatives of W at a node, [order in i_d][order in i_q]. */
typedef struct {
    double f[3][3];
} orders_t;

static orders_t orders_of(const map_node_t *n)
{
    return (orders_t){{{n->W, n->q, n->qq}, {n->d, n->dq, n->dqq}, {n->dd, n->ddq, n->ddqq}}};
}

map_node_t map_patch_extend(const map_node_t *node, double by_d_A, double by_q_A)
{
    orders_t o = orders_of(node);
    for (int b = 0; b < 3; b++) {
        o.f[0][b] += by_d_A * (o.f[1][b] + 0.5 * by_d_A * o.f[2][b]);
        o.f[1][b] += by_d_A * o.f[2][b];
    }
    for (int a = 0; a < 3; a++) {
        o.f[a][0] += by_q_A * (o.f[a][1] + 0.5 * by_q_A * o.f[a][2]);
        o.f[a][1] += by_q_A * o.f[a][2];
    }
    return (map_node_t){o.f[0][0], o.f[1][0], o.f[0][1], o.f[2][0], o.f[1][1],
                        o.f[0][2], o.f[2][1], o.f[1][2], o.f[2][2]};
}

/* Quintic on 0 ... 1 from value, slope and curvature at both ends; in place. */
static void hermite(double *f, int stride)
{
    double f0 = f[0], s0 = f[stride], k0 = 0.5 * f[2 * stride];
    double rise = f[3 * stride] - f0 - s0 - k0;
    double s1 = f[4 * stride] - s0 - 2.0 * k0;
    double k1 = 0.5 * f[5 * stride] - k0;
    f[2 * stride] = k0;
    f[3 * stride] = 10.0 * rise - 4.0 * s1 + k1;
    f[4 * stride] = -15.0 * rise + 7.0 * s1 - 2.0 * k1;
    f[5 * stride] = 6.0 * rise - 3.0 * s1 + k1;
}

void map_patch_set(double c[MAP_PATCH], const map_node_t corner[4], double h_d_A, double h_q_A)
{
    const double scale_d[3] = {1.0, h_d_A, h_d_A * h_d_A}, scale_q[3] = {1.0, h_q_A, h_q_A * h_q_A};
    for (int k = 0; k < 4; k++) {
        orders_t o = orders_of(&corner[k]);
        for (int a = 0; a < 3; a++) {
            for (int b = 0; b < 3; b++) {
                c[6 * (3 * (k % 2) + b) + 3 * (k / 2) + a] = o.f[a][b] * scale_d[a] * scale_q[b];
            }
        }
    }
    for (int b = 0; b < 6; b++) {
        hermite(&c[6 * b], 1);
    }
    for (int a = 0; a < 6; a++) {
        hermite(&c[a], 6);
    }
}

map_value_t map_patch_value(const double c[MAP_PATCH], double t, double u)
{
    double p[6], p_u[6], p_uu[6]; /* of u, for each power of t */
    double u2 = u * u, u3 = u2 * u;
    for (int a = 0; a < 6; a++) {
        double c2 = c[12 + a], c3 = c[18 + a], c4 = c[24 + a], c5 = c[30 + a];
        p[a] = c[a] + u * c[6 + a] + u2 * (c2 + u * c3) + u2 * u2 * (c4 + u * c5);
        p_u[a] = c[6 + a] + u * (2.0 * c2 + u * (3.0 * c3)) + u3 * (4.0 * c4 + u * (5.0 * c5));
        p_uu[a] = 2.0 * c2 + u * (6.0 * c3) + u2 * (12.0 * c4 + u * (20.0 * c5));
    }
    double t2 = t * t, t3 = t2 * t, t4 = t2 * t2, t5 = t4 * t;
    return (map_value_t){
        .W = p[0] + t * p[1] + t2 * p[2] + t3 * p[3] + t4 * p[4] + t5 * p[5],
        .d = p[1] + 2.0 * t * p[2] + 3.0 * t2 * p[3] + 4.0 * t3 * p[4] + 5.0 * t4 * p[5],
        .dd = 2.0 * p[2] + 6.0 * t * p[3] + 12.0 * t2 * p[4] + 20.0 * t3 * p[5],
        .q = p_u[0] + t * p_u[1] + t2 * p_u[2] + t3 * p_u[3] + t4 * p_u[4] + t5 * p_u[5],
        .dq = p_u[1] + 2.0 * t * p_u[2] + 3.0 * t2 * p_u[3] + 4.0 * t3 * p_u[4] + 5.0 * t4 * p_u[5],
        .qq = p_uu[0] + t * p_uu[1] + t2 * p_uu[2] + t3 * p_uu[3] + t4 * p_uu[4] + t5 * p_uu[5],
    };
}
