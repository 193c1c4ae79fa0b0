/* Substitute with the columns of a factor, multiply matrices with several vectors, sweep over small problems with
   friction, and exchange active sets: compiled once for every user, see compiled.py. Nothing here needs a library but libm. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* y <- L^-1 y and y <- L^-T y on the first `inner` columns, for one load or for k: L and A are read once for up to 8 of
   them, whose numbers lie side by side in y. Loads and answers are the rows of b and out. A width that the compiler knows
   keeps them in registers. Two columns with the same rows go together where that was measured faster: with many loads it
   halves the ways to y, with one the processor waits for L, which comes faster as one stream. Sums go in one order for any
   width, products in that of PETSc for nodes, so that rounding is the same too. */
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && defined(__GLIBC__)
#define FASTEST __attribute__((target_clones("avx2", "default")))
#else
#define FASTEST
#endif
#define EACH for (int c = 0; c < w; c++)

static int width(int left) { return left > 4 ? 8 : left > 2 ? 4 : left; }

static inline __attribute__((always_inline)) void
gather(const int w, int k, long n, const int *order, const double *b, double *restrict y) {
    for (long j = 0; j < n; j++)
        EACH y[j * w + c] = c < k ? b[c * n + (order ? order[j] : j)] : 0.0;
}

static inline __attribute__((always_inline)) void
scatter(const int w, int k, long n, const int *order, const double *y, double *restrict out) {
    for (long j = 0; j < n; j++)
        for (int c = 0; c < k; c++) out[c * n + (order ? order[j] : j)] = y[j * w + c];
}

static inline __attribute__((always_inline)) void
forward_of(const int w, int inner, const long *p, const int *i, const double *x, double *restrict y) {
    for (int j = 0; j < inner; j++) {
        double t[8], u[8], *mine = y + (long) j * w;
        const double *one = x + p[j], *other = x + p[j + 1];
        const long high = p[j + 1] - p[j];
        const int *row = i + p[j], two = w > 2 && row[0];
        EACH t[c] = mine[c] *= one[0];
        if (two) {
            EACH u[c] = mine[w + c] = (mine[w + c] - one[1] * t[c]) * other[0];
            for (long k = 2; k < high; k++) {
                double *to = y + (long) row[k] * w;
                EACH to[c] = (to[c] - one[k] * t[c]) - other[k - 1] * u[c];
            }
            j++;
        } else
            for (long k = 1; k < high; k++) {
                double *to = y + (long) row[k] * w;
                EACH to[c] -= one[k] * t[c];
            }
    }
}

/* Memory is read downwards, within columns too: one stream for the processor. Of two columns with the same rows the first
   has one row more, that of the second, which is known when the others have been summed up. */
static inline __attribute__((always_inline)) void
backward_of(const int w, int inner, const long *p, const int *i, const double *x, double *restrict y) {
    for (int j = inner - 1; j >= 0; j--) {
        const int two = w > 4 && j > 0 && i[p[j - 1]];
        const double *one = x + p[j], *other = two ? x + p[j - 1] + 1 : one;
        const int *row = i + p[j];
        double s[4][8], t[4][8], *mine = y + (long) j * w;
        for (int q = 0; q < 4; q++) EACH s[q][c] = t[q][c] = 0.0;
        long k = p[j + 1] - p[j] - 1, left;
        for (; k > 3; k -= 4)
            for (int q = 0; q < 4; q++) {
                const double *from = y + (long) row[k - q] * w;
                EACH s[q][c] += one[k - q] * from[c];
                if (two) EACH t[q][c] += other[k - q] * from[c];
            }
        for (left = k; left > 0; left--) EACH s[0][c] += one[left] * y[(long) row[left] * w + c];
        EACH mine[c] = (mine[c] - ((s[0][c] + s[1][c]) + (s[2][c] + s[3][c]))) * one[0];
        if (!two) continue;
        const int rest[4] = {j, k > 0 ? row[1] : 0, k > 1 ? row[2] : 0, k > 2 ? row[3] : 0};
        for (int q = 0; k == 3 && q < 4; q++) EACH t[q][c] += other[3 - q] * y[(long) rest[3 - q] * w + c];
        for (; k < 3 && k >= 0; k--) EACH t[0][c] += other[k] * y[(long) rest[k] * w + c];
        EACH mine[c - w] = (mine[c - w] - ((t[0][c] + t[1][c]) + (t[2][c] + t[3][c]))) * x[p[j - 1]];
        j--;
    }
}

static inline __attribute__((always_inline)) void
product_of(const int w, int k, long n, const int *p, const int *i, const double *x, const double *in, double *restrict out) {
    for (long j = 0; j < n; j++) {
        double s[8];
        EACH s[c] = 0.0;
        int e = p[j];
        for (; e < p[j + 1] - 1; e += 2)
            EACH s[c] += x[e] * in[(long) i[e] * w + c] + x[e + 1] * in[(long) i[e + 1] * w + c];
        if (e < p[j + 1]) EACH s[c] += x[e] * in[(long) i[e] * w + c];
        for (int c = 0; c < k; c++) out[c * n + j] = s[c];
    }
}

FASTEST void forward(int inner, const long *p, const int *i, const double *x, double *y) { forward_of(1, inner, p, i, x, y); }
FASTEST void backward(int inner, const long *p, const int *i, const double *x, double *y) { backward_of(1, inner, p, i, x, y); }

#define BY_WIDTH(call) switch (w) { case 8: call(8); break; case 4: call(4); break; case 2: call(2); break; default: call(1); }

FASTEST void forward_many(int k, int n, int inner, const long *p, const int *i, const double *x, const int *order,
                          const double *b, double *y, double *corner) {
    const long m = n - inner;
    for (int w; k > 0; k -= w, b += (long) w * n, y += (long) w * n, corner += w * m) {
        w = width(k);
#define CALL(W) gather(W, k < W ? k : W, n, order, b, y); forward_of(W, inner, p, i, x, y)
        BY_WIDTH(CALL)
#undef CALL
        for (long j = 0; j < m; j++)
            for (int c = 0; c < w && c < k; c++) corner[c * m + j] = y[(inner + j) * w + c];
    }
}

FASTEST void backward_many(int k, int n, int inner, const long *p, const int *i, const double *x, const int *order,
                           const double *corner, double *y, double *out) {
    const long m = n - inner;
    for (int w; k > 0; k -= w, y += (long) w * n, out += (long) w * n, corner += w * m) {
        w = width(k);
        for (long j = 0; j < m; j++)
            for (int c = 0; c < w && c < k; c++) y[(inner + j) * w + c] = corner[c * m + j];
#define CALL(W) backward_of(W, inner, p, i, x, y); scatter(W, k < W ? k : W, n, order, y, out)
        BY_WIDTH(CALL)
#undef CALL
    }
}

/* out = A b, row by row of both, for a matrix in compressed rows; room: 8 n numbers. */
FASTEST void product_many(int k, int n, const int *p, const int *i, const double *x, const double *b, double *room, double *out) {
    for (int w; k > 0; k -= w, b += (long) w * n, out += (long) w * n) {
        w = width(k);
#define CALL(W) gather(W, k < W ? k : W, n, NULL, b, room); product_of(W, k < W ? k : W, n, p, i, x, room, out)
        BY_WIDTH(CALL)
#undef CALL
    }
}

#define GROUP 81             /* largest number of nodes that are solved together */
#define INSIDE (1.0 - 1e-15) /* a slip reaction is on its disk, and not outside by rounding */

/* A small problem with friction: m nodes of d unknowns, w = q + G r, disks of radius cohesion + slope max(r_n, 0). G and its
   inverse H are given to single precision, and H's blocks of d x d inverted; H may be missing. */
typedef struct {
    int m, d;
    const float *G, *H, *blocks;
    const double *cohesion, *slope;
    const char *bilateral;
} Rubbing;

/* Solve the nodes [from, to) one after the other, with all others as they are. From G, r is `own`, and w = base + other
   follows each change of r; from H, w is own, and r follows. Returns the largest change of r. `states`: open, stick, slip. */
static inline __attribute__((always_inline)) double
nodes(const Rubbing *of, const int d, const int inverse, int from, int to, double *restrict own,
      const double *restrict base, float *restrict other, char *restrict states) {
    const long n = (long) of->m * d, stride = inverse ? d : n, end = (long) to * d;
    double largest = 0.0;
    for (int i = from; i < to; i++) {
        const long f = (long) i * d;
        const float *row = (inverse ? of->H : of->G) + f * n, *block = inverse ? of->blocks + f * d : row + f;
        double r[3], w[3], change[3], stiffest = 0.0, size = 0.0, most = 0.0;
        float by[3];
        for (int k = 0; k < d; k++) {
            const double follows = base[f + k] + other[f + k];
            r[k] = inverse ? follows : own[f + k];
            w[k] = inverse ? own[f + k] : follows;
        }
        double y_n = r[0] - w[0] / block[0];
        if (!of->bilateral[i]) y_n = fmax(y_n, 0.0);
        const double limit = of->cohesion[i] + of->slope[i] * fmax(y_n, 0.0);
        change[0] = y_n - r[0];
        for (int k = 1; k < d; k++) stiffest = fmax(stiffest, block[k * stride + k]);
        for (int k = 1; k < d; k++) { /* the tangents know the normal's change */
            change[k] = r[k] - (w[k] + change[0] * block[k * stride]) / stiffest;
            size += change[k] * change[k];
        }
        const int slips = size > limit * limit;
        const double factor = slips ? limit / sqrt(size) * INSIDE : 1.0;
        states[i] = y_n == 0.0 ? 0 : !slips ? 1 : change[1] > 0.0 ? 2 : 3;
        for (int k = 1; k < d; k++) change[k] = factor * change[k] - r[k];
        for (int k = 0; k < d; k++) most = fmax(most, fabs(change[k]));
        if (most == 0.0) continue;
        largest = fmax(largest, most);
        for (int k = 0; k < d; k++) {
            double moved = inverse ? 0.0 : change[k];
            for (int l = 0; inverse && l < d; l++) moved += block[k * stride + l] * change[l];
            own[f + k] += moved;
            by[k] = moved;
        }
        for (long j = (long) from * d; j < end; j++)
            other[j] += by[0] * row[j] + by[1] * row[n + j] + (d == 3 ? by[2] * row[2 * n + j] : 0.0f);
    }
    return largest;
}

/* One sweep over all nodes, by groups small enough for the cache, each passed over twice; what follows outside of a group
   does so once. */
static inline __attribute__((always_inline)) double
sweep(const Rubbing *of, const int d, const int inverse, double *restrict own, const double *restrict base,
      float *restrict other, char *restrict states) {
    const int group = d == 3 ? GROUP : GROUP / 3;
    const long n = (long) of->m * d;
    double largest = 0.0, before[3 * GROUP];
    for (int from = 0; from < of->m; from += group) {
        const int to = of->m - from < group ? of->m : from + group;
        const long first = (long) from * d, end = (long) to * d;
        memcpy(before, own + first, (end - first) * sizeof(double));
        for (int pass = 0; pass < 2; pass++)
            largest = fmax(largest, nodes(of, d, inverse, from, to, own, base, other, states));
        for (long f = first; f < end; f += d) {
            const float *row = (inverse ? of->H : of->G) + f * n;
            float by[3] = {0.0f};
            for (int k = 0; k < d; k++) by[k] = own[f + k] - before[f - first + k];
            if (by[0] == 0.0f && by[1] == 0.0f && by[2] == 0.0f) continue;
            for (int side = 0; side < 2; side++)
                for (long j = side ? end : 0; j < (side ? n : first); j++)
                    other[j] += by[0] * row[j] + by[1] * row[n + j] + (d == 3 ? by[2] * row[2 * n + j] : 0.0f);
        }
    }
    return largest;
}

/* `sweeps` of projected Gauss-Seidel over r and w. Without H they end when r changes by `least` only. With H every second
   is with it, and they end when no state differs from two sweeps before. What r and w follow each other by is summed up in
   single precision (`room`, m (d + 1)), and is to be made anew where that is not enough. Returns the last change of r. */
FASTEST double relax(int m, int d, const float *G, const float *H, const float *blocks, const double *cohesion,
                     const double *slope, const char *bilateral, int sweeps, double least, double *r, double *w, float *room) {
    const Rubbing of = {m, d, G, H, blocks, cohesion, slope, bilateral};
    const long n = (long) m * d;
    double largest = INFINITY;
    char *states = (char *) (room + n), *before = states + m;
    memset(room, 0, (n + m) * sizeof(float));
    for (int s = 0; s < sweeps && largest > least; s++) {
        const int inverse = H && s % 2;
        double *own = inverse ? w : r, *base = inverse ? r : w;
        largest = d == 3 ? (inverse ? sweep(&of, 3, 1, own, base, room, states) : sweep(&of, 3, 0, own, base, room, states))
                         : (inverse ? sweep(&of, 2, 1, own, base, room, states) : sweep(&of, 2, 0, own, base, room, states));
        if (!H && s < sweeps - 1 && largest > least) continue;
        for (long j = 0; j < n; j++) base[j] += room[j];
        memset(room, 0, n * sizeof(float));
        if (!H || inverse) continue;
        if (s && !memcmp(states, before, m)) break;
        memcpy(before, states, m);
    }
    return largest;
}

#define BELOW(value) ((value) >= 0.0 ? 0.0 : (value)) /* the negative part */

/* The first exchanges of the active-set method for k small problems 0 <= r, q + G r >= 0 with one G of m rows: see
   active_set.py, which has the same for one of them, and goes on where changes[] says -1. `limit` times |r|_max is the
   rounding of q + G r. `sets` and `factors` (k, m, m) are kept from call to call: the last set of every row, 2 in its first
   place where there is none, and its factor; moved (k, most): rows that changed sides in each exchange; room: 3 m
   numbers. */
static inline __attribute__((always_inline)) int decompose(const int n, double *restrict L) { /* column by column, lower */
    for (int j = 0; j < n; j++) {
        double *mine = L + (long) j * n;
        if (!(mine[j] > 0.0)) return 0;
        const double pivot = sqrt(mine[j]);
        for (int i = j; i < n; i++) mine[i] /= pivot;
        for (int c = j + 1; c < n; c++) {
            double *other = L + (long) c * n;
            const double t = mine[c];
            for (int i = c; i < n; i++) other[i] -= t * mine[i];
        }
    }
    return 1;
}

static inline __attribute__((always_inline)) void substituted(const int n, const double *L, double *restrict y) {
    for (int j = 0; j < n; j++) {
        const double *mine = L + (long) j * n, t = y[j] /= mine[j];
        for (int i = j + 1; i < n; i++) y[i] -= t * mine[i];
    }
    for (int j = n - 1; j >= 0; j--) {
        const double *mine = L + (long) j * n;
        double s[4] = {0.0, 0.0, 0.0, 0.0};
        int i = j + 1;
        for (; i + 3 < n; i += 4)
            for (int c = 0; c < 4; c++) s[c] += mine[i + c] * y[i + c];
        for (; i < n; i++) s[0] += mine[i] * y[i];
        y[j] = (y[j] - ((s[0] + s[1]) + (s[2] + s[3]))) / mine[j];
    }
}

/* w = gap + G r for the r of the places in `at`. */
static inline __attribute__((always_inline)) void
pushed(const int m, const int n, const int *at, const double *G, const double *gap, const double *r, double *restrict w) {
    memcpy(w, gap, m * sizeof(double));
    for (int a = 0; a < n; a++) {
        const double *row = G + (long) at[a] * m, t = r[at[a]];
        for (int j = 0; j < m; j++) w[j] += t * row[j];
    }
}

FASTEST void exchanges(int k, int m, int most, double limit, double tolerance, const double *G, const double *scale,
                       const char *held, const double *q, const char *guess, char *sets, double *factors, double *room,
                       int *places, double *r, char *closed, double *residual, int *changes, int *moved) {
    for (; k > 0; k--, q += m, guess += m, sets += m, factors += (long) m * m, r += m, closed += m, residual++,
                  changes++, moved += most) {
        double *gap = room, *w = room + m, *part = room + 2 * m, unit = 0.0;
        int sound = 1;
        for (int j = 0; j < m; j++) {
            gap[j] = q[j] * scale[j];
            const double off = held[j] ? fabs(gap[j]) : BELOW(gap[j]);
            sound &= fabs(off) < HUGE_VAL;
            unit = fmax(unit, fabs(off));
            closed[j] = held[j] || (guess[j] && gap[j] < HUGE_VAL);
            r[j] = 0.0;
        }
        *residual = 0.0;
        *changes = sound && unit == 0.0 ? 0 : -1;
        for (int change = 0; sound && unit > 0.0 && change <= most; change++) {
            if (memcmp(closed, sets, m)) {
                int n = 0;
                for (int j = 0; j < m; j++)
                    if (closed[j]) places[n++] = j;
                for (int a = 0; a < n; a++)
                    for (int c = a; c < n; c++) factors[(long) a * n + c] = G[(long) places[a] * m + places[c]];
                memcpy(sets, closed, m);
                if (!decompose(n, factors)) { sets[0] = 2; break; }
            }
            int n = 0, wrong = 0;
            for (int j = 0; j < m; j++) {
                r[j] = 0.0;
                if (closed[j]) { part[n] = -gap[j]; places[n++] = j; }
            }
            substituted(n, factors, part);
            double top = 0.0, least = 0.0, off = 0.0;
            for (int a = 0; a < n; a++) { r[places[a]] = part[a]; top = fmax(top, fabs(part[a])); }
            pushed(m, n, places, G, gap, r, w);
            for (int j = 0; j < m; j++) {
                if (held[j]) continue;
                const int other = (closed[j] ? r[j] : w[j]) < -limit * top;
                wrong += other;
                least = fmin(least, r[j]);
                part[j] = other;
            }
            if (wrong) {
                if (change == most) break;
                moved[change] = wrong;
                for (int j = 0; j < m; j++)
                    if (!held[j] && part[j] != 0.0) closed[j] = !closed[j];
                continue;
            }
            if (least < 0.0) { /* by rounding: r >= 0 holds exactly */
                for (int j = 0; j < m; j++)
                    if (!held[j]) r[j] = fmax(r[j], 0.0);
                pushed(m, n, places, G, gap, r, w);
            }
            for (int j = 0; j < m; j++) {
                const double one = fabs(held[j] ? w[j] : fmin(r[j], w[j]));
                off = one <= off ? off : one;
            }
            *residual = off / unit;
            if (*residual <= tolerance) *changes = change;
            break;
        }
        for (int j = 0; j < m; j++) {
            closed[j] = held[j] || r[j] > 0.0;
            r[j] *= scale[j];
        }
    }
}
