/* Exchange active sets of small problems: see exchanges.py. */
#include <math.h>
#include <string.h>

#include "fastest.h"

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
