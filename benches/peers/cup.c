/* The cup of examples/cup/cup.gml as one would write it by hand: outer and inner surface and handle, with their derivatives.
 *
 * Every row of a grid (one v) is a conic in space: point(u) = c + a cos(2 pi u) + b sin(2 pi u). What depends on v only is
 * computed once a row, the cosines and sines once a column. Points are x, y, z each, row after row (u runs fastest). */
#include <math.h>
#include <string.h>

#define PARAMS 15
enum { X, Y, Z, ALPHA, BETA, GAMMA, SHAPE, R, H, H1, H2A, H2B, H3A, H3B, H4 };
#define MAX_COLUMNS 4096
#define TUBE 5.0

typedef double vec[3];
typedef double mat[3][3];

/* Rz(gamma) Ry(beta) Rx(alpha), and its derivatives by the angles. */
static void rotation(const double *x, mat m, mat da, mat db, mat dc) {
    double ca = cos(x[ALPHA]), sa = sin(x[ALPHA]);
    double cb = cos(x[BETA]), sb = sin(x[BETA]);
    double cc = cos(x[GAMMA]), sc = sin(x[GAMMA]);
    mat r = {{cb * cc, sa * sb * cc - ca * sc, ca * sb * cc + sa * sc},
             {cb * sc, sa * sb * sc + ca * cc, ca * sb * sc - sa * cc},
             {-sb, sa * cb, ca * cb}};
    mat a = {{0, ca * sb * cc + sa * sc, -sa * sb * cc + ca * sc},
             {0, ca * sb * sc - sa * cc, -sa * sb * sc - ca * cc},
             {0, ca * cb, -sa * cb}};
    mat b = {{-sb * cc, sa * cb * cc, ca * cb * cc}, {-sb * sc, sa * cb * sc, ca * cb * sc}, {-cb, -sa * sb, -ca * sb}};
    mat c = {{-r[1][0], -r[1][1], -r[1][2]}, {r[0][0], r[0][1], r[0][2]}, {0, 0, 0}};
    memcpy(m, r, sizeof r);
    memcpy(da, a, sizeof a);
    memcpy(db, b, sizeof b);
    memcpy(dc, c, sizeof c);
}

/* A row before it is placed: (c.x + a cos, b sin, c.z + d cos). */
typedef struct {
    double cx, cz, ax, az, by;
} row;

/* A part at one v: the row, and its derivatives by the parameters from SHAPE on. */
typedef void part(const double *x, double v, row *value, row *slopes);

static void outside(const double *x, double v, row *value, row *slopes) {
    double power = pow(v, 3 + x[SHAPE]);
    *value = (row){.cz = x[H] * power, .ax = x[R] * v, .by = x[R] * v};
    if (!slopes) return;
    slopes[SHAPE - SHAPE].cz = v > 0 ? x[H] * power * log(v) : 0;
    slopes[R - SHAPE].ax = slopes[R - SHAPE].by = v;
    slopes[H - SHAPE].cz = power;
}

static void inside(const double *x, double v, row *value, row *slopes) {
    double n = 2 + x[SHAPE], root = pow(24.0 / 25.0, 1 / n), rim = root - 0.1, back = 1 - v;
    double q = rim * back + 0.1, power = pow(q, n);
    *value = (row){.cz = x[H] * (1.0 / 25.0 + power), .ax = x[R] * rim * back, .by = x[R] * rim * back};
    if (!slopes) return;
    double drim = -root * log(24.0 / 25.0) / (n * n);
    row *s = &slopes[SHAPE - SHAPE];
    s->cz = x[H] * power * (log(q) + n / q * drim * back);
    s->ax = s->by = x[R] * drim * back;
    slopes[R - SHAPE].ax = slopes[R - SHAPE].by = rim * back;
    slopes[H - SHAPE].cz = 1.0 / 25.0 + power;
}

static void handle(const double *x, double v, row *value, row *slopes) {
    double w = 1 - v;
    double b[4] = {w * w * w, 3 * w * w * v, 3 * w * v * v, v * v * v};
    double d[4] = {-3 * w * w, 3 * w * w - 6 * w * v, 6 * w * v - 3 * v * v, 3 * v * v};
    double n = 3 + x[SHAPE], first = pow(x[H1], n), last = pow(x[H4], n);
    double px[4] = {x[H1], x[H2A], x[H3A], x[H4]}, pz[4] = {first, x[H2B], x[H3B], last};
    double sx = 0, sz = 0, tx = 0, tz = 0;
    for (int i = 0; i < 4; i++) {
        sx += b[i] * px[i], sz += b[i] * pz[i];
        tx += d[i] * px[i], tz += d[i] * pz[i];
    }
    double ex = x[R] * tx, ez = x[H] * tz, length = sqrt(ex * ex + ez * ez);
    double ax = ex / length, az = ez / length;
    *value = (row){.cx = x[R] * sx, .cz = x[H] * sz, .ax = az * TUBE, .az = -ax * TUBE, .by = TUBE};
    if (!slopes) return;
    /* By each parameter: the derivatives of the curve's point and of its tangent. */
    double dfirst = first * log(x[H1]), dlast = last * log(x[H4]);
    double by[9][4] = {
        {0, x[H] * (b[0] * dfirst + b[3] * dlast), 0, x[H] * (d[0] * dfirst + d[3] * dlast)},
        {sx, 0, tx, 0},
        {0, sz, 0, tz},
        {x[R] * b[0], x[H] * b[0] * n * first / x[H1], x[R] * d[0], x[H] * d[0] * n * first / x[H1]},
        {x[R] * b[1], 0, x[R] * d[1], 0},
        {0, x[H] * b[1], 0, x[H] * d[1]},
        {x[R] * b[2], 0, x[R] * d[2], 0},
        {0, x[H] * b[2], 0, x[H] * d[2]},
        {x[R] * b[3], x[H] * b[3] * n * last / x[H4], x[R] * d[3], x[H] * d[3] * n * last / x[H4]},
    };
    for (int i = 0; i < 9; i++) {
        double turn = TUBE * (az * by[i][2] - ax * by[i][3]) / length;
        slopes[i] = (row){.cx = by[i][0], .cz = by[i][1], .ax = -ax * turn, .az = -az * turn, .by = 0};
    }
}

/* A matrix times a row: c, a and b in space. */
static void placed(mat m, const row *q, vec c, vec a, vec b) {
    for (int k = 0; k < 3; k++) {
        c[k] = m[k][0] * q->cx + m[k][2] * q->cz;
        a[k] = m[k][0] * q->ax + m[k][2] * q->az;
        b[k] = m[k][1] * q->by;
    }
}

/* The derivatives of a row by all parameters: for each coordinate, for each parameter. */
typedef double slopes_of_row[3][PARAMS];

static void slopes_at(const double *x, part *p, int params, double v, mat m, mat by_angle[3], slopes_of_row c,
                      slopes_of_row a, slopes_of_row b) {
    row value, slopes[9] = {0};
    p(x, v, &value, slopes);
    memset(c, 0, sizeof(slopes_of_row));
    memset(a, 0, sizeof(slopes_of_row));
    memset(b, 0, sizeof(slopes_of_row));
    for (int k = 0; k < 3; k++) c[k][X + k] = 1;
    for (int i = ALPHA; i < params; i++) {
        vec ci, ai, bi;
        if (i < SHAPE)
            placed(by_angle[i - ALPHA], &value, ci, ai, bi);
        else
            placed(m, &slopes[i - SHAPE], ci, ai, bi);
        for (int k = 0; k < 3; k++) c[k][i] = ci[k], a[k][i] = ai[k], b[k][i] = bi[k];
    }
}

static void circle(const double *u, int columns, double *cosines, double *sines) {
    for (int i = 0; i < columns; i++) {
        cosines[i] = cos(2 * M_PI * u[i]);
        sines[i] = sin(2 * M_PI * u[i]);
    }
}

static part *const PARTS[3] = {outside, inside, handle};
static const int ACTIVE[3] = {H1, H1, PARAMS};

/* Points of a part (0 outside, 1 inside, 2 handle): out[rows][columns][3]. */
void cup_points(const double *x, int which, const double *u, int columns, const double *v, int rows,
                double *restrict out) {
    double cosines[MAX_COLUMNS], sines[MAX_COLUMNS];
    mat m, da, db, dc;
    rotation(x, m, da, db, dc);
    circle(u, columns, cosines, sines);
    for (int j = 0; j < rows; j++) {
        row value;
        vec c, a, b;
        PARTS[which](x, v[j], &value, 0);
        placed(m, &value, c, a, b);
        double c0 = c[0] + x[X], c1 = c[1] + x[Y], c2 = c[2] + x[Z];
        for (int i = 0; i < columns; i++) {
            out[3 * i] = c0 + a[0] * cosines[i] + b[0] * sines[i];
            out[3 * i + 1] = c1 + a[1] * cosines[i] + b[1] * sines[i];
            out[3 * i + 2] = c2 + a[2] * cosines[i] + b[2] * sines[i];
        }
        out += 3 * columns;
    }
}

/* The dense Jacobian of a part: out[rows][columns][3][15]. */
void cup_jacobian(const double *x, int which, const double *u, int columns, const double *v, int rows,
                  double *restrict out) {
    double cosines[MAX_COLUMNS], sines[MAX_COLUMNS];
    mat m, by[3];
    rotation(x, m, by[0], by[1], by[2]);
    circle(u, columns, cosines, sines);
    for (int j = 0; j < rows; j++) {
        slopes_of_row c, a, b;
        slopes_at(x, PARTS[which], ACTIVE[which], v[j], m, by, c, a, b);
        const double *c0 = c[0], *a0 = a[0], *b0 = b[0];
        for (int i = 0; i < columns; i++) {
            for (int k = 0; k < 3 * PARAMS; k++) out[k] = c0[k] + a0[k] * cosines[i] + b0[k] * sines[i];
            out += 3 * PARAMS;
        }
    }
}

/* Adds the sum over the points of J^T w to gradient[15]: w[rows][columns][3]. */
void cup_pullback(const double *x, int which, const double *u, int columns, const double *v, int rows,
                  const double *restrict w, double *restrict gradient) {
    double cosines[MAX_COLUMNS], sines[MAX_COLUMNS];
    mat m, by[3];
    rotation(x, m, by[0], by[1], by[2]);
    circle(u, columns, cosines, sines);
    for (int j = 0; j < rows; j++) {
        slopes_of_row c, a, b;
        slopes_at(x, PARTS[which], ACTIVE[which], v[j], m, by, c, a, b);
        vec sum = {0}, of_cosines = {0}, of_sines = {0};
        for (int i = 0; i < columns; i++)
            for (int k = 0; k < 3; k++) {
                sum[k] += w[3 * i + k];
                of_cosines[k] += w[3 * i + k] * cosines[i];
                of_sines[k] += w[3 * i + k] * sines[i];
            }
        for (int k = 0; k < 3; k++)
            for (int i = 0; i < PARAMS; i++)
                gradient[i] += sum[k] * c[k][i] + of_cosines[k] * a[k][i] + of_sines[k] * b[k][i];
        w += 3 * columns;
    }
}
