/* Factorise A = L L' by CHOLMOD with given unknowns last, and substitute by supernodes: see
   contact_last.py. It is compiled once for every user where PETSc has CHOLMOD: see compiler.py.

   CHOLMOD is linked as PETSc links it, and never copied into this package: its supernodal part is
   under the GPL. Matrices are symmetric and come whole, in compressed columns with sorted rows, of
   which CHOLMOD reads the lower triangle. Functions that can fail return CHOLMOD's status. */
#include <cholmod.h>
#include <stdlib.h>
#include <string.h>

/* A factor, with what CHOLMOD keeps from one substitution to the next. */
typedef struct {
    cholmod_common common;
    cholmod_factor *L;
    cholmod_dense *X, *Y, *E;
} Factor;

/* The matrix of these compressed columns, which is not copied; x is NULL for a pattern. */
static cholmod_sparse symmetric(int n, int *p, int *i, double *x) {
    cholmod_sparse A;
    memset(&A, 0, sizeof A);
    A.nrow = n;
    A.ncol = n;
    A.nzmax = p[n];
    A.p = p;
    A.i = i;
    A.x = x;
    A.stype = -1; /* read the lower triangle */
    A.itype = CHOLMOD_INT;
    A.xtype = x ? CHOLMOD_REAL : CHOLMOD_PATTERN;
    A.dtype = CHOLMOD_DOUBLE;
    A.sorted = 1;
    A.packed = 1;
    return A;
}

/* Begin with CHOLMOD: L L' and not L D L', one ordering, and no messages. */
static void start(cholmod_common *common) {
    cholmod_start(common);
    common->print = 0;
    common->nmethods = 1;
    common->final_ll = 1;
    common->try_catch = 1;
}

/* An order of little fill of the rows that have a number in `among`, in which the elimination tree
   is numbered child before parent. `among`: -1 for the others, and else ascending from 0; perm
   holds such numbers. */
int order(int n, const int *p, const int *i, const int *among, int dissect, int *perm) {
    cholmod_common common;
    cholmod_factor *L = NULL;
    int *starts = malloc((n + 1) * sizeof(int));
    int *rows = malloc((p[n] + 1L) * sizeof(int));
    int count = 0;
    int entries = 0;
    start(&common);
    common.method[0].ordering = dissect ? CHOLMOD_METIS : CHOLMOD_AMD;
    common.supernodal = CHOLMOD_SIMPLICIAL;
    if (starts && rows) {
        /* The lower triangle of these rows alone, and its analysis. */
        for (int j = 0; j < n; j++) {
            if (among[j] < 0) continue;
            starts[count++] = entries;
            for (int k = p[j]; k < p[j + 1]; k++)
                if (i[k] >= j && among[i[k]] >= 0) rows[entries++] = among[i[k]];
        }
        starts[count] = entries;
        cholmod_sparse A = symmetric(count, starts, rows, NULL);
        L = cholmod_analyze(&A, &common);
    } else {
        common.status = CHOLMOD_OUT_OF_MEMORY;
    }
    int status = CHOLMOD_OK;
    if (!L) status = common.status ? common.status : CHOLMOD_INVALID;
    if (L) memcpy(perm, L->Perm, count * sizeof(int));
    cholmod_free_factor(&L, &common);
    cholmod_finish(&common);
    free(starts);
    free(rows);
    return status;
}

/* Free a factor. */
void release(Factor *f) {
    cholmod_free_dense(&f->X, &f->common);
    cholmod_free_dense(&f->Y, &f->common);
    cholmod_free_dense(&f->E, &f->common);
    cholmod_free_factor(&f->L, &f->common);
    cholmod_finish(&f->common);
    free(f);
}

/* Factorise in this order, which stays as it is: what is last in it is last in L. `made` gets the
   factor, or NULL. */
int factorise(int n, int *p, int *i, double *x, int *perm, Factor **made) {
    cholmod_sparse A = symmetric(n, p, i, x);
    Factor *f = calloc(1, sizeof(Factor));
    *made = NULL;
    if (!f) return CHOLMOD_OUT_OF_MEMORY;
    start(&f->common);
    f->common.method[0].ordering = CHOLMOD_GIVEN;
    f->common.postorder = 0; /* it would change the order */
    f->common.supernodal = CHOLMOD_SUPERNODAL;
    f->L = cholmod_analyze_p(&A, perm, NULL, 0, &f->common);
    if (f->L) cholmod_factorize(&A, f->L, &f->common);

    /* `minor` is the first column whose pivot was not positive, and n where there is none. */
    const int whole = f->L && f->L->minor == f->L->n && f->L->is_super;
    const int status = whole ? f->common.status : CHOLMOD_NOT_POSDEF;
    if (status == CHOLMOD_OK)
        *made = f;
    else
        release(f);
    return status;
}

/* The entries of the first `inner` columns, counted when p is NULL; zeros that supernodes store are
   left out. Each column begins with its diagonal entry, inverted; in the place of its row stands
   whether the next column has the same rows below its own diagonal. `corner`: the other columns,
   dense (m, m), column by column. Returns the number of entries. */
long columns(const Factor *f, int inner, long *p, int *i, double *x, double *corner) {
    const cholmod_factor *L = f->L;
    const int *first = L->super; /* column of each supernode */
    const int *from = L->pi;     /* where its rows begin */
    const int *at = L->px;       /* where its values begin */
    const int *rows = L->s;
    const long m = L->n - inner;
    long count = 0;
    for (size_t k = 0; k < L->nsuper; k++) {
        /* A supernode is a dense block: its columns have the same rows. */
        const int *row = rows + from[k];
        const long high = from[k + 1] - from[k];
        for (int j = first[k]; j < first[k + 1]; j++) {
            const double *value = (const double *) L->x + at[k] + (j - first[k]) * high;
            if (j < inner && p) p[j] = count;
            for (long r = j - first[k]; r < high; r++) {
                if (j >= inner) {
                    if (corner) corner[(row[r] - inner) + m * (j - inner)] = value[r];
                } else if (value[r] != 0.0) {
                    if (p) {
                        i[count] = row[r];
                        x[count] = row[r] == j ? 1.0 / value[r] : value[r];
                    }
                    count++;
                }
            }
        }
    }
    if (!p) return count;
    p[inner] = count;

    /* Which columns have the rows of the next one: one entry more, its diagonal, and the others
       alike. */
    for (int j = 0; j < inner; j++) {
        const long high = p[j + 1] - p[j] - 1;
        i[p[j]] = j + 1 < inner && high > 0 && p[j + 2] - p[j + 1] == high && i[p[j] + 1] == j + 1
                  && !memcmp(i + p[j] + 2, i + p[j + 1] + 1, (high - 1) * sizeof(int));
    }
    return count;
}

/* y <- L^-1 y (CHOLMOD_L, 4), L^-T y (CHOLMOD_Lt, 5), or A^-1 y (CHOLMOD_A, 0), by supernodes; k of
   them, one after the other in memory. */
int substitute(Factor *f, int system, int k, double *y) {
    cholmod_dense B;
    memset(&B, 0, sizeof B);
    B.nrow = f->L->n;
    B.d = B.nrow;
    B.nzmax = B.nrow * k;
    B.ncol = k;
    B.x = y;
    B.xtype = CHOLMOD_REAL;
    B.dtype = CHOLMOD_DOUBLE;
    if (!cholmod_solve2(system, f->L, &B, NULL, &f->X, NULL, &f->Y, &f->E, &f->common))
        return f->common.status;
    memcpy(y, f->X->x, sizeof(double) * B.nzmax);
    return CHOLMOD_OK;
}

/* Whether the CHOLMOD that runs is of the version of the header: structures change between
   versions. */
int header_fits(void) {
    int found[3];
    cholmod_version(found);
    return found[0] == CHOLMOD_MAIN_VERSION && found[1] == CHOLMOD_SUB_VERSION;
}
