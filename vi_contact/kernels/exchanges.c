/* Exchange active sets of small problems: see exchanges.py. */
#include <math.h>
#include <string.h>

#include "fastest.h"

#define NEGATIVE_PART(value) ((value) >= 0.0 ? 0.0 : (value))
#define NO_SET 2 /* in the first place of a remembered set: none is remembered */

/* Factorise a positive definite matrix of n rows in place, L L' with L column by column in the
   lower triangle. Returns 0 where a pivot is not positive. */
static inline __attribute__((always_inline)) int
decompose(const int n, double *restrict L) {
    for (int j = 0; j < n; j++) {
        double *column = L + (long) j * n;
        if (!(column[j] > 0.0)) return 0;
        const double pivot = sqrt(column[j]);
        for (int i = j; i < n; i++) column[i] /= pivot;

        /* What is left of the columns to the right. */
        for (int c = j + 1; c < n; c++) {
            double *other = L + (long) c * n;
            const double t = column[c];
            for (int i = c; i < n; i++) other[i] -= t * column[i];
        }
    }
    return 1;
}

/* y <- (L L')^-1 y, forward and backward. The sums of the backward one go in four parts, which is
   an order of their own: they do not wait for each other. */
static inline __attribute__((always_inline)) void
substitute_both_ways(const int n, const double *L, double *restrict y) {
    for (int j = 0; j < n; j++) {
        const double *column = L + (long) j * n;
        const double t = y[j] /= column[j];
        for (int i = j + 1; i < n; i++) y[i] -= t * column[i];
    }
    for (int j = n - 1; j >= 0; j--) {
        const double *column = L + (long) j * n;
        double s[4] = {0.0, 0.0, 0.0, 0.0};
        int i = j + 1;
        for (; i + 3 < n; i += 4)
            for (int c = 0; c < 4; c++) s[c] += column[i + c] * y[i + c];
        for (; i < n; i++) s[0] += column[i] * y[i];
        y[j] = (y[j] - ((s[0] + s[1]) + (s[2] + s[3]))) / column[j];
    }
}

/* w = gap + G r (m), for an r that is zero but at n places. */
static inline __attribute__((always_inline)) void
add_reactions(const int m, const int n, const int *places, const double *G, const double *gap,
              const double *r, double *restrict w) {
    memcpy(w, gap, m * sizeof(double));
    for (int a = 0; a < n; a++) {
        const double *row = G + (long) places[a] * m;
        const double t = r[places[a]];
        for (int j = 0; j < m; j++) w[j] += t * row[j];
    }
}

/* The first exchanges of the active-set method for k small problems 0 <= r, q + G r >= 0 with one G
   of m rows: see active_set.py, which has the same for one of them, and goes on where changes[]
   says -1.

   most:      number of exchanges after which they end
   limit:     times |r|_max, the rounding of q + G r
   tolerance: residual, over the largest violation by q, that an answer may have
   G, scale:  d G d (m, m), and d (m)
   held:      (m) which rows are equations
   q, guess:  (k, m)
   sets, factors: (k, m) and (k, m, m), kept from call to call: the last set of every row, NO_SET in
              its first place where there is none, and its factor
   room, places: 3 m and m numbers
   r, closed, residual, changes: the answers, (k, m) and (k)
   moved:     (k, most) rows that changed sides in each exchange */
FASTEST void
exchanges(int k, int m, int most, double limit, double tolerance, const double *G,
          const double *scale, const char *held, const double *q, const char *guess, char *sets,
          double *factors, double *room, int *places, double *r, char *closed, double *residual,
          int *changes, int *moved) {
    for (; k > 0; k--) {
        double *gap = room;
        double *w = room + m;
        double *part = room + 2 * m; /* r on the set, then the rows that are wrong */
        double unit = 0.0;
        int sound = 1;

        /* Scaled gaps, the set to start from, and the violation by r = 0. */
        for (int j = 0; j < m; j++) {
            gap[j] = q[j] * scale[j];
            const double off = held[j] ? fabs(gap[j]) : NEGATIVE_PART(gap[j]);
            sound &= fabs(off) < HUGE_VAL;
            unit = fmax(unit, fabs(off));
            closed[j] = held[j] || (guess[j] && gap[j] < HUGE_VAL);
            r[j] = 0.0;
        }
        *residual = 0.0;
        *changes = sound && unit == 0.0 ? 0 : -1;

        for (int change = 0; sound && unit > 0.0 && change <= most; change++) {
            /* The factor of G on the set, unless it is that of the last one. */
            if (memcmp(closed, sets, m)) {
                int n = 0;
                for (int j = 0; j < m; j++)
                    if (closed[j]) places[n++] = j;
                for (int a = 0; a < n; a++)
                    for (int c = a; c < n; c++)
                        factors[(long) a * n + c] = G[(long) places[a] * m + places[c]];
                memcpy(sets, closed, m);
                if (!decompose(n, factors)) {
                    sets[0] = NO_SET;
                    break;
                }
            }

            /* r with w = 0 on the set, and w off it. */
            int n = 0;
            int wrong = 0;
            for (int j = 0; j < m; j++) {
                r[j] = 0.0;
                if (closed[j]) {
                    part[n] = -gap[j];
                    places[n++] = j;
                }
            }
            substitute_both_ways(n, factors, part);
            double top = 0.0;
            double least = 0.0;
            double off = 0.0;
            for (int a = 0; a < n; a++) {
                r[places[a]] = part[a];
                top = fmax(top, fabs(part[a]));
            }
            add_reactions(m, n, places, G, gap, r, w);

            /* Rows whose sign is wrong by more than rounding: they change sides. */
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

            /* None is wrong: what is negative by rounding becomes zero, as r >= 0 holds exactly. */
            if (least < 0.0) {
                for (int j = 0; j < m; j++)
                    if (!held[j]) r[j] = fmax(r[j], 0.0);
                add_reactions(m, n, places, G, gap, r, w);
            }

            /* The residual; the comparison keeps NaN. */
            for (int j = 0; j < m; j++) {
                const double violation = fabs(held[j] ? w[j] : fmin(r[j], w[j]));
                off = violation <= off ? off : violation;
            }
            *residual = off / unit;
            if (*residual <= tolerance) *changes = change;
            break;
        }

        /* The answer in newtons, and on to the next problem. */
        for (int j = 0; j < m; j++) {
            closed[j] = held[j] || r[j] > 0.0;
            r[j] *= scale[j];
        }
        q += m;
        guess += m;
        sets += m;
        factors += (long) m * m;
        r += m;
        closed += m;
        residual++;
        changes++;
        moved += most;
    }
}
