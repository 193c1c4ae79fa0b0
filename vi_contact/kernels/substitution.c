/* Substitute with the columns of a factor, and multiply matrices with several vectors: see
   contact_last.py. */
#include <stddef.h>

#include "fastest.h"

/* y <- L^-1 y and y <- L^-T y on the first `inner` columns, for one load or for k: L and A are read once for up to 8 of
   them, whose numbers lie side by side in y. Loads and answers are the rows of b and out. A width that the compiler knows
   keeps them in registers. Two columns with the same rows go together where that was measured faster: with many loads it
   halves the ways to y, with one the processor waits for L, which comes faster as one stream. Sums go in one order for any
   width, products in that of PETSc for nodes, so that rounding is the same too. */
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
