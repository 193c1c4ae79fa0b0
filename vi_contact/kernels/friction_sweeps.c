/* Sweep over small problems with friction: see friction_sweeps.py. */
#include <math.h>
#include <string.h>

#include "fastest.h"

#define GROUP 81             /* largest number of nodes that are solved together */
#define INSIDE (1.0 - 1e-15) /* a slip reaction is on its disk, and not outside by rounding */

/* What a node does: its slip is along its first tangent, or against it. */
enum { OPEN, STICK, SLIP_ALONG, SLIP_AGAINST };

/* A small problem with friction: m nodes of d unknowns, w = q + G r, disks of radius
   cohesion + slope max(r_n, 0). G and its inverse H are given to single precision, and H's blocks
   of d x d inverted; H may be missing. */
typedef struct {
    int m, d;
    const float *G, *H, *blocks;
    const double *cohesion, *slope;
    const char *bilateral;
} Rubbing;

/* Solve the nodes [from, to) one after the other, with all others as they are. From G, r is `own`,
   and w = base + other follows each change of r; from H, w is own, and r follows. `states` gets
   what every node does. Returns the largest change of r. */
static inline __attribute__((always_inline)) double
solve_nodes(const Rubbing *problem, const int d, const int inverse, int from, int to,
            double *restrict own, const double *restrict base, float *restrict other,
            char *restrict states) {
    const long n = (long) problem->m * d;
    const long stride = inverse ? d : n; /* of the rows of a block */
    const long end = (long) to * d;
    double largest = 0.0;
    for (int i = from; i < to; i++) {
        const long f = (long) i * d;
        const float *row = (inverse ? problem->H : problem->G) + f * n;
        const float *block = inverse ? problem->blocks + f * d : row + f;
        double r[3];
        double w[3];
        double change[3];
        double stiffest = 0.0;
        double size = 0.0;
        double most = 0.0;
        float by[3];
        for (int k = 0; k < d; k++) {
            const double follows = base[f + k] + other[f + k];
            r[k] = inverse ? follows : own[f + k];
            w[k] = inverse ? own[f + k] : follows;
        }

        /* Normal: r_n with w_n = 0, or zero. It gives the friction limit. */
        double y_n = r[0] - w[0] / block[0];
        if (!problem->bilateral[i]) y_n = fmax(y_n, 0.0);
        const double limit = problem->cohesion[i] + problem->slope[i] * fmax(y_n, 0.0);
        change[0] = y_n - r[0];

        /* Tangents: a step along w_t, which knows the change of r_n, and back onto the disk. */
        for (int k = 1; k < d; k++) stiffest = fmax(stiffest, block[k * stride + k]);
        for (int k = 1; k < d; k++) {
            change[k] = r[k] - (w[k] + change[0] * block[k * stride]) / stiffest;
            size += change[k] * change[k];
        }
        const int slips = size > limit * limit;
        const double factor = slips ? limit / sqrt(size) * INSIDE : 1.0;
        states[i] = y_n == 0.0        ? OPEN
                    : !slips          ? STICK
                    : change[1] > 0.0 ? SLIP_ALONG
                                      : SLIP_AGAINST;
        for (int k = 1; k < d; k++) change[k] = factor * change[k] - r[k];
        for (int k = 0; k < d; k++) most = fmax(most, fabs(change[k]));
        if (most == 0.0) continue;
        largest = fmax(largest, most);

        /* Own values of the node: r, or from H its w, changed by the block. */
        for (int k = 0; k < d; k++) {
            double moved = inverse ? 0.0 : change[k];
            for (int l = 0; inverse && l < d; l++) moved += block[k * stride + l] * change[l];
            own[f + k] += moved;
            by[k] = moved;
        }

        /* What follows them, at the nodes of the group. */
        for (long j = (long) from * d; j < end; j++)
            other[j] += by[0] * row[j] + by[1] * row[n + j]
                        + (d == 3 ? by[2] * row[2 * n + j] : 0.0f);
    }
    return largest;
}

/* One sweep over all nodes, by groups small enough for the cache, each passed over twice; what
   follows outside of a group does so once. Arguments and result are those of solve_nodes. */
static inline __attribute__((always_inline)) double
sweep(const Rubbing *problem, const int d, const int inverse, double *restrict own,
      const double *restrict base, float *restrict other, char *restrict states) {
    const int group = d == 3 ? GROUP : GROUP / 3;
    const long n = (long) problem->m * d;
    double largest = 0.0;
    double before[3 * GROUP];
    for (int from = 0; from < problem->m; from += group) {
        const int to = problem->m - from < group ? problem->m : from + group;
        const long first = (long) from * d;
        const long end = (long) to * d;
        memcpy(before, own + first, (end - first) * sizeof(double));
        for (int pass = 0; pass < 2; pass++) {
            const double changed
                = solve_nodes(problem, d, inverse, from, to, own, base, other, states);
            largest = fmax(largest, changed);
        }

        /* The changes of each node of the group, carried to all nodes outside of it. */
        for (long f = first; f < end; f += d) {
            const float *row = (inverse ? problem->H : problem->G) + f * n;
            float by[3] = {0.0f};
            for (int k = 0; k < d; k++) by[k] = own[f + k] - before[f - first + k];
            if (by[0] == 0.0f && by[1] == 0.0f && by[2] == 0.0f) continue;
            for (int side = 0; side < 2; side++)
                for (long j = side ? end : 0; j < (side ? n : first); j++)
                    other[j] += by[0] * row[j] + by[1] * row[n + j]
                                + (d == 3 ? by[2] * row[2 * n + j] : 0.0f);
        }
    }
    return largest;
}

/* `count` sweeps of projected Gauss-Seidel over r and w. Without H they end when r changes by
   `least` only. With H every second is with it, and they end when no state differs from two sweeps
   before. What r and w follow each other by is summed up in single precision (`room`, m (d + 1)
   numbers), and is to be made anew where that is not enough. Returns the last change of r. */
FASTEST double
relax(int m, int d, const float *G, const float *H, const float *blocks, const double *cohesion,
      const double *slope, const char *bilateral, int count, double least, double *r, double *w,
      float *room) {
    const Rubbing problem = {m, d, G, H, blocks, cohesion, slope, bilateral};
    const long n = (long) m * d;
    double largest = INFINITY;
    char *states = (char *) (room + n);
    char *before = states + m;
    memset(room, 0, (n + m) * sizeof(float));
    for (int s = 0; s < count && largest > least; s++) {
        const int inverse = H && s % 2;
        double *own = inverse ? w : r;
        double *base = inverse ? r : w;

        /* Dimension and matrix are constants for the compiler, which makes four functions. */
        if (d == 3)
            largest = inverse ? sweep(&problem, 3, 1, own, base, room, states)
                              : sweep(&problem, 3, 0, own, base, room, states);
        else
            largest = inverse ? sweep(&problem, 2, 1, own, base, room, states)
                              : sweep(&problem, 2, 0, own, base, room, states);
        if (!H && s < count - 1 && largest > least) continue;

        /* What has followed in single precision goes into the array in double precision. */
        for (long j = 0; j < n; j++) base[j] += room[j];
        memset(room, 0, n * sizeof(float));
        if (!H || inverse) continue;
        if (s && !memcmp(states, before, m)) break;
        memcpy(before, states, m);
    }
    return largest;
}
