/* Substitute with the columns of a factor, and multiply matrices with several vectors: see
   contact_last.py. */
#include <stddef.h>

#include "fastest.h"

/* y <- L^-1 y and y <- L^-T y on the first `inner` columns, for one load or for k: L and A are read
   once for up to 8 of them, whose numbers lie side by side in y. Loads and answers are the rows of
   b and out. L is stored column by column: that of j has the entries x[p[j]], x[p[j] + 1], … with
   the rows i[…]; the first is its diagonal entry, inverted, and in the place of its row stands
   whether the next column has the same rows below its own diagonal (see factor.c).

   A width w that the compiler knows keeps the numbers of a row in registers. Two columns with the
   same rows go together where that was measured faster: with many loads it halves the ways to y,
   with one the processor waits for L, which comes faster as one stream. Sums go in one order for
   any width, products in that of PETSc for nodes, so that rounding is the same too. */
#define EACH for (int c = 0; c < w; c++)

/* How many of these loads are substituted together, as one of the widths 8, 4, 2 and 1. */
static int width(int left) { return left > 4 ? 8 : left > 2 ? 4 : left; }

/* Put k loads side by side into y, rows in the order of elimination; the others of w are zero. */
static inline __attribute__((always_inline)) void
gather(const int w, int k, long n, const int *order, const double *b, double *restrict y) {
    for (long j = 0; j < n; j++)
        EACH y[j * w + c] = c < k ? b[c * n + (order ? order[j] : j)] : 0.0;
}

/* Put what lies side by side in y into k rows of out, in the order of the matrix. */
static inline __attribute__((always_inline)) void
scatter(const int w, int k, long n, const int *order, const double *y, double *restrict out) {
    for (long j = 0; j < n; j++)
        for (int c = 0; c < k; c++) out[c * n + (order ? order[j] : j)] = y[j * w + c];
}

/* y <- L^-1 y, column by column: each is subtracted from all rows below. */
static inline __attribute__((always_inline)) void
forward_of(const int w, int inner, const long *p, const int *i, const double *x,
           double *restrict y) {
    for (int j = 0; j < inner; j++) {
        double t[8];
        double u[8];
        double *own = y + (long) j * w;
        const double *column = x + p[j];
        const double *next = x + p[j + 1];
        const long high = p[j + 1] - p[j];
        const int *row = i + p[j];
        const int two = w > 2 && row[0];
        EACH t[c] = own[c] *= column[0];
        if (two) {
            EACH u[c] = own[w + c] = (own[w + c] - column[1] * t[c]) * next[0];
            for (long k = 2; k < high; k++) {
                double *to = y + (long) row[k] * w;
                EACH to[c] = (to[c] - column[k] * t[c]) - next[k - 1] * u[c];
            }
            j++;
        } else
            for (long k = 1; k < high; k++) {
                double *to = y + (long) row[k] * w;
                EACH to[c] -= column[k] * t[c];
            }
    }
}

/* y <- L^-T y, from the last column to the first: each sums up the rows below. Memory is read
   downwards, within columns too: one stream for the processor. Of two columns with the same rows
   the first has one row more, that of the second, which is known when the others have been summed
   up. */
static inline __attribute__((always_inline)) void
backward_of(const int w, int inner, const long *p, const int *i, const double *x,
            double *restrict y) {
    for (int j = inner - 1; j >= 0; j--) {
        const int two = w > 4 && j > 0 && i[p[j - 1]];
        const double *column = x + p[j];
        const double *before = two ? x + p[j - 1] + 1 : column;
        const int *row = i + p[j];
        double s[4][8];
        double t[4][8];
        double *own = y + (long) j * w;

        /* Sums in four parts, of column j in s and of the one before in t. */
        for (int q = 0; q < 4; q++) EACH s[q][c] = t[q][c] = 0.0;
        long k = p[j + 1] - p[j] - 1;
        long left;
        for (; k > 3; k -= 4)
            for (int q = 0; q < 4; q++) {
                const double *from = y + (long) row[k - q] * w;
                EACH s[q][c] += column[k - q] * from[c];
                if (two) EACH t[q][c] += before[k - q] * from[c];
            }
        for (left = k; left > 0; left--) EACH s[0][c] += column[left] * y[(long) row[left] * w + c];
        EACH own[c] = (own[c] - ((s[0][c] + s[1][c]) + (s[2][c] + s[3][c]))) * column[0];
        if (!two) continue;

        /* The rows of the column before that are left, in the parts where they would be alone. */
        const int rest[4] = {j, k > 0 ? row[1] : 0, k > 1 ? row[2] : 0, k > 2 ? row[3] : 0};
        for (int q = 0; k == 3 && q < 4; q++)
            EACH t[q][c] += before[3 - q] * y[(long) rest[3 - q] * w + c];
        for (; k < 3 && k >= 0; k--) EACH t[0][c] += before[k] * y[(long) rest[k] * w + c];
        EACH own[c - w]
            = (own[c - w] - ((t[0][c] + t[1][c]) + (t[2][c] + t[3][c]))) * x[p[j - 1]];
        j--;
    }
}

/* k rows of out = A times what lies side by side in `in`, for a matrix in compressed rows. */
static inline __attribute__((always_inline)) void
product_of(const int w, int k, long n, const int *p, const int *i, const double *x,
           const double *in, double *restrict out) {
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

/* One load: y (n), in place. */
FASTEST void
forward(int inner, const long *p, const int *i, const double *x, double *y) {
    forward_of(1, inner, p, i, x, y);
}

FASTEST void
backward(int inner, const long *p, const int *i, const double *x, double *y) {
    backward_of(1, inner, p, i, x, y);
}

/* Call a function of the width w with a constant that the compiler knows. */
#define BY_WIDTH(call) \
    switch (w) { \
    case 8: \
        call(8); \
        break; \
    case 4: \
        call(4); \
        break; \
    case 2: \
        call(2); \
        break; \
    default: \
        call(1); \
    }

/* Forward for k loads b (k, n), w of them at a time: y keeps what they became, for backward_many,
   and corner (k, n - inner) gets the last rows. y has room for k rounded up to a width. */
FASTEST void
forward_many(int k, int n, int inner, const long *p, const int *i, const double *x,
             const int *order, const double *b, double *y, double *corner) {
    const long m = n - inner;
    for (int w; k > 0; k -= w, b += (long) w * n, y += (long) w * n, corner += w * m) {
        w = width(k);
#define CALL(W) \
    gather(W, k < W ? k : W, n, order, b, y); \
    forward_of(W, inner, p, i, x, y)
        BY_WIDTH(CALL)
#undef CALL
        for (long j = 0; j < m; j++)
            for (int c = 0; c < w && c < k; c++) corner[c * m + j] = y[(inner + j) * w + c];
    }
}

/* Backward for what forward_many has left in y, with the last rows from corner (k, n - inner); the
   answers go to out (k, n). */
FASTEST void
backward_many(int k, int n, int inner, const long *p, const int *i, const double *x,
              const int *order, const double *corner, double *y, double *out) {
    const long m = n - inner;
    for (int w; k > 0; k -= w, y += (long) w * n, out += (long) w * n, corner += w * m) {
        w = width(k);
        for (long j = 0; j < m; j++)
            for (int c = 0; c < w && c < k; c++) y[(inner + j) * w + c] = corner[c * m + j];
#define CALL(W) \
    backward_of(W, inner, p, i, x, y); \
    scatter(W, k < W ? k : W, n, order, y, out)
        BY_WIDTH(CALL)
#undef CALL
    }
}

/* out = A b, row by row of both, for a matrix in compressed rows; room: 8 n numbers. */
FASTEST void
product_many(int k, int n, const int *p, const int *i, const double *x, const double *b,
             double *room, double *out) {
    for (int w; k > 0; k -= w, b += (long) w * n, out += (long) w * n) {
        w = width(k);
#define CALL(W) \
    gather(W, k < W ? k : W, n, NULL, b, room); \
    product_of(W, k < W ? k : W, n, p, i, x, room, out)
        BY_WIDTH(CALL)
#undef CALL
    }
}
