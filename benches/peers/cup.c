/* The cup of examples/cup/cup.gml as one would write it by hand: outer and inner surface and handle, with their derivatives.
 *
 * Every row (one v) is a conic in space: before the part is placed a point is (cx + ax cos, by sin, cz + az cos) of 2 pi u.
 * What depends on the parameters only is computed once a call; at scattered points each takes its own sine, cosine and power;
 * on a grid they are computed once a column and once a row. */
#include <math.h>
#include <string.h>

#define PARAMS 15
enum { X, Y, Z, ALPHA, BETA, GAMMA, SHAPE, R, H, H1, H2A, H2B, H3A, H3B, H4 };
#define MAX_COLUMNS 4096
#define TUBE 5.0
#define INLINE static inline __attribute__((always_inline))

typedef double vec[3];
typedef double mat[3][3];

/* What depends on the parameters only. */
typedef struct {
    const double *x;
    /* Rz(gamma) Ry(beta) Rx(alpha), and its derivatives by the angles. */
    mat m, by_angle[3];
    /* The inner radius at the rim, of 1, and its derivative by the shape. */
    double rim, drim;
    /* The handle's control points, and the powers at its ends with their derivatives by the shape. */
    double px[4], pz[4], first, last, dfirst, dlast;
} cup;

static void prepare(const double *x, cup *c) {
    c->x = x;
    double ca = cos(x[ALPHA]), sa = sin(x[ALPHA]);
    double cb = cos(x[BETA]), sb = sin(x[BETA]);
    double cc = cos(x[GAMMA]), sc = sin(x[GAMMA]);
    mat r = {{cb * cc, sa * sb * cc - ca * sc, ca * sb * cc + sa * sc},
             {cb * sc, sa * sb * sc + ca * cc, ca * sb * sc - sa * cc},
             {-sb, sa * cb, ca * cb}};
    mat da = {{0, ca * sb * cc + sa * sc, -sa * sb * cc + ca * sc},
              {0, ca * sb * sc - sa * cc, -sa * sb * sc - ca * cc},
              {0, ca * cb, -sa * cb}};
    mat db = {{-sb * cc, sa * cb * cc, ca * cb * cc}, {-sb * sc, sa * cb * sc, ca * cb * sc}, {-cb, -sa * sb, -ca * sb}};
    mat dc = {{-r[1][0], -r[1][1], -r[1][2]}, {r[0][0], r[0][1], r[0][2]}, {0, 0, 0}};
    memcpy(c->m, r, sizeof r);
    memcpy(c->by_angle[0], da, sizeof da);
    memcpy(c->by_angle[1], db, sizeof db);
    memcpy(c->by_angle[2], dc, sizeof dc);
    double n = 2 + x[SHAPE], root = pow(24.0 / 25.0, 1 / n);
    c->rim = root - 0.1, c->drim = -root * log(24.0 / 25.0) / (n * n);
    c->first = pow(x[H1], 3 + x[SHAPE]), c->last = pow(x[H4], 3 + x[SHAPE]);
    c->dfirst = c->first * log(x[H1]), c->dlast = c->last * log(x[H4]);
    double px[4] = {x[H1], x[H2A], x[H3A], x[H4]}, pz[4] = {c->first, x[H2B], x[H3B], c->last};
    memcpy(c->px, px, sizeof px);
    memcpy(c->pz, pz, sizeof pz);
}

/* A row before it is placed. */
typedef struct {
    double cx, cz, ax, az, by;
} row;

/* The row of a part at v, and its derivatives by v up to an order. */
typedef void rows_of(const cup *c, double v, int order, row *q);

INLINE void outside(const cup *c, double v, int order, row *q) {
    const double *x = c->x;
    double n = 3 + x[SHAPE], r = x[R], h = x[H];
    if (order == 0) {
        q[0] = (row){0, h * pow(v, n), r * v, 0, r * v};
        return;
    }
    double two_less = order > 1 ? pow(v, n - 2) : 0, one_less = order > 1 ? two_less * v : pow(v, n - 1);
    q[0] = (row){0, h * one_less * v, r * v, 0, r * v};
    q[1] = (row){0, h * n * one_less, r, 0, r};
    if (order > 1) q[2] = (row){0, h * n * (n - 1) * two_less, 0, 0, 0};
}

INLINE void inside(const cup *c, double v, int order, row *q) {
    const double *x = c->x;
    double n = 2 + x[SHAPE], r = x[R], h = x[H], rim = c->rim, at = rim * (1 - v) + 0.1;
    double radius = r * rim * (1 - v);
    if (order == 0) {
        q[0] = (row){0, h * (1.0 / 25.0 + pow(at, n)), radius, 0, radius};
        return;
    }
    double two_less = order > 1 ? pow(at, n - 2) : 0, one_less = order > 1 ? two_less * at : pow(at, n - 1);
    q[0] = (row){0, h * (1.0 / 25.0 + one_less * at), radius, 0, radius};
    q[1] = (row){0, -h * n * rim * one_less, -r * rim, 0, -r * rim};
    if (order > 1) q[2] = (row){0, h * n * (n - 1) * rim * rim * two_less, 0, 0, 0};
}

INLINE double sum4(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]; }

INLINE void handle(const cup *c, double v, int order, row *q) {
    double r = c->x[R], h = c->x[H], w = 1 - v;
    double b[4] = {w * w * w, 3 * w * w * v, 3 * w * v * v, v * v * v};
    double d[4] = {-3 * w * w, 3 * w * w - 6 * w * v, 6 * w * v - 3 * v * v, 3 * v * v};
    double ex = r * sum4(d, c->px), ez = h * sum4(d, c->pz), per_length = 1 / sqrt(ex * ex + ez * ez);
    double ax = ex * per_length, az = ez * per_length;
    q[0] = (row){r * sum4(b, c->px), h * sum4(b, c->pz), az * TUBE, -ax * TUBE, TUBE};
    if (order == 0) return;
    /* The tangent turns by `turn` and `turn2`: first and second derivative of its angle. */
    double d2[4] = {6 * w, 6 * v - 12 * w, 6 * w - 12 * v, 6 * v};
    double fx = r * sum4(d2, c->px), fz = h * sum4(d2, c->pz), per_square = per_length * per_length;
    double turn = (ex * fz - ez * fx) * per_square;
    q[1] = (row){ex, ez, ax * turn * TUBE, az * turn * TUBE, 0};
    if (order == 1) return;
    double d3[4] = {-6, 18, -18, 6};
    double gx = r * sum4(d3, c->px), gz = h * sum4(d3, c->pz);
    double turn2 = (ex * gz - ez * gx - 2 * turn * (ex * fx + ez * fz)) * per_square;
    q[2] = (row){fx, fz, (ax * turn2 - az * turn * turn) * TUBE, (az * turn2 + ax * turn * turn) * TUBE, 0};
}

INLINE void turned(const mat m, double x, double y, double z, double *out) {
    for (int k = 0; k < 3; k++) out[k] = m[k][0] * x + m[k][1] * y + m[k][2] * z;
}

/* Points with their derivatives by u and v up to an order at scattered (u, v): out[n][3, 9 or 18]. */
INLINE void derivatives(const cup *c, rows_of *part, int order, const double *u, const double *v, int n,
                        double *restrict out) {
    const double tau = 2 * M_PI;
    for (int i = 0; i < n; i++) {
        double angle = tau * u[i], co = cos(angle), si = sin(angle);
        row q[3];
        part(c, v[i], order, q);
        turned(c->m, q[0].cx + q[0].ax * co, q[0].by * si, q[0].cz + q[0].az * co, out);
        for (int k = 0; k < 3; k++) out[k] += c->x[X + k];
        out += 3;
        if (order == 0) continue;
        turned(c->m, -tau * q[0].ax * si, tau * q[0].by * co, -tau * q[0].az * si, out);
        turned(c->m, q[1].cx + q[1].ax * co, q[1].by * si, q[1].cz + q[1].az * co, out + 3);
        out += 6;
        if (order == 1) continue;
        turned(c->m, -tau * tau * q[0].ax * co, -tau * tau * q[0].by * si, -tau * tau * q[0].az * co, out);
        turned(c->m, -tau * q[1].ax * si, tau * q[1].by * co, -tau * q[1].az * si, out + 3);
        turned(c->m, q[2].cx + q[2].ax * co, q[2].by * si, q[2].cz + q[2].az * co, out + 6);
        out += 9;
    }
}

/* Points (order 0), with partials (1), with second partials (2) of a part (0 outside, 1 inside, 2 handle). */
void cup_derivatives(const double *x, int part, int order, const double *u, const double *v, int n, double *out) {
    cup c;
    prepare(x, &c);
    switch (3 * part + order) {
    case 0: derivatives(&c, outside, 0, u, v, n, out); break;
    case 1: derivatives(&c, outside, 1, u, v, n, out); break;
    case 2: derivatives(&c, outside, 2, u, v, n, out); break;
    case 3: derivatives(&c, inside, 0, u, v, n, out); break;
    case 4: derivatives(&c, inside, 1, u, v, n, out); break;
    case 5: derivatives(&c, inside, 2, u, v, n, out); break;
    case 6: derivatives(&c, handle, 0, u, v, n, out); break;
    case 7: derivatives(&c, handle, 1, u, v, n, out); break;
    case 8: derivatives(&c, handle, 2, u, v, n, out); break;
    }
}

/* The derivatives by position and angles of the point whose place before it is placed is (x, y, z). */
INLINE void by_pose(const cup *c, double x, double y, double z, double *out) {
    const double unit[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    memcpy(out, unit, sizeof unit);
    for (int angle = 0; angle < 3; angle++) turned(c->by_angle[angle], x, y, z, out + 9 + 3 * angle);
}

/* Derivatives by the parameters that a part depends on, at scattered points: out[n][9 or 15][3]. */
void cup_jacobian(const double *x, int part, const double *u, const double *v, int n, double *restrict out) {
    cup cup_at_x, *c = &cup_at_x;
    prepare(x, c);
    double exponent = 3 + x[SHAPE] - part, r = x[R], h = x[H];
    for (int i = 0; i < n; i++) {
        double angle = 2 * M_PI * u[i], co = cos(angle), si = sin(angle);
        if (part == 0) {
            double power = pow(v[i], exponent), radius = r * v[i];
            by_pose(c, radius * co, radius * si, h * power, out);
            turned(c->m, 0, 0, v[i] > 0 ? h * power * log(v[i]) : 0, out + 18);
            turned(c->m, v[i] * co, v[i] * si, 0, out + 21);
            turned(c->m, 0, 0, power, out + 24);
            out += 27;
        } else if (part == 1) {
            double back = 1 - v[i], at = c->rim * back + 0.1, power = pow(at, exponent);
            double radius = c->rim * back, height = 1.0 / 25.0 + power, dradius = r * c->drim * back;
            by_pose(c, r * radius * co, r * radius * si, h * height, out);
            double dheight = h * power * (log(at) + exponent / at * c->drim * back);
            turned(c->m, dradius * co, dradius * si, dheight, out + 18);
            turned(c->m, radius * co, radius * si, 0, out + 21);
            turned(c->m, 0, 0, height, out + 24);
            out += 27;
        } else {
            double w = 1 - v[i], v_ = v[i];
            double b[4] = {w * w * w, 3 * w * w * v_, 3 * w * v_ * v_, v_ * v_ * v_};
            double d[4] = {-3 * w * w, 3 * w * w - 6 * w * v_, 6 * w * v_ - 3 * v_ * v_, 3 * v_ * v_};
            double sx = sum4(b, c->px), sz = sum4(b, c->pz), tx = sum4(d, c->px), tz = sum4(d, c->pz);
            double ex = r * tx, ez = h * tz, per_length = 1 / sqrt(ex * ex + ez * ez);
            double ax = ex * per_length, az = ez * per_length;
            by_pose(c, r * sx + TUBE * az * co, TUBE * si, h * sz - TUBE * ax * co, out);
            double p[4] = {x[H1], 0, 0, x[H4]}, power[4] = {c->first, 0, 0, c->last};
            /* By each parameter: the derivatives of the curve's point and of its tangent. */
            double by[9][4] = {
                {0, h * (b[0] * c->dfirst + b[3] * c->dlast), 0, h * (d[0] * c->dfirst + d[3] * c->dlast)},
                {sx, 0, tx, 0},
                {0, sz, 0, tz},
                {r * b[0], h * b[0] * (3 + x[SHAPE]) * power[0] / p[0], r * d[0], h * d[0] * (3 + x[SHAPE]) * power[0] / p[0]},
                {r * b[1], 0, r * d[1], 0},
                {0, h * b[1], 0, h * d[1]},
                {r * b[2], 0, r * d[2], 0},
                {0, h * b[2], 0, h * d[2]},
                {r * b[3], h * b[3] * (3 + x[SHAPE]) * power[3] / p[3], r * d[3], h * d[3] * (3 + x[SHAPE]) * power[3] / p[3]},
            };
            for (int k = 0; k < 9; k++) {
                double turn = TUBE * co * (az * by[k][2] - ax * by[k][3]) * per_length;
                turned(c->m, by[k][0] - ax * turn, 0, by[k][1] - az * turn, out + 18 + 3 * k);
            }
            out += 45;
        }
    }
}

/* Adds the sum over scattered points of J^T w to gradient[15]: w[n][3]. */
void cup_pullback(const double *x, int part, const double *u, const double *v, int n, const double *restrict w,
                  double *restrict gradient) {
    cup cup_at_x, *c = &cup_at_x;
    prepare(x, c);
    double exponent = 3 + x[SHAPE] - part, r = x[R], h = x[H];
    /* Sums of w, and of w by the place before it is placed; of the handle's control points, and of its ends' powers. */
    double sum[3] = {0}, moments[3][3] = {{0}}, by_shape = 0, by_r = 0, by_h = 0, of_px[4] = {0}, of_pz[4] = {0};
    for (int i = 0; i < n; i++, w += 3) {
        double angle = 2 * M_PI * u[i], co = cos(angle), si = sin(angle), p[3], t[3];
        /* w turned back. */
        for (int k = 0; k < 3; k++) t[k] = c->m[0][k] * w[0] + c->m[1][k] * w[1] + c->m[2][k] * w[2];
        if (part == 0) {
            double power = pow(v[i], exponent);
            p[0] = r * v[i] * co, p[1] = r * v[i] * si, p[2] = h * power;
            by_shape += v[i] > 0 ? t[2] * h * power * log(v[i]) : 0;
            by_r += (t[0] * co + t[1] * si) * v[i];
            by_h += t[2] * power;
        } else if (part == 1) {
            double back = 1 - v[i], at = c->rim * back + 0.1, power = pow(at, exponent), radius = c->rim * back;
            double height = 1.0 / 25.0 + power, round = t[0] * co + t[1] * si;
            p[0] = r * radius * co, p[1] = r * radius * si, p[2] = h * height;
            by_shape += round * r * c->drim * back + t[2] * h * power * (log(at) + exponent / at * c->drim * back);
            by_r += round * radius;
            by_h += t[2] * height;
        } else {
            double back = 1 - v[i], v_ = v[i];
            double b[4] = {back * back * back, 3 * back * back * v_, 3 * back * v_ * v_, v_ * v_ * v_};
            double d[4] = {-3 * back * back, 3 * back * back - 6 * back * v_, 6 * back * v_ - 3 * v_ * v_, 3 * v_ * v_};
            double ex = r * sum4(d, c->px), ez = h * sum4(d, c->pz), per_length = 1 / sqrt(ex * ex + ez * ez);
            double ax = ex * per_length, az = ez * per_length;
            p[0] = r * sum4(b, c->px) + TUBE * az * co, p[1] = TUBE * si, p[2] = h * sum4(b, c->pz) - TUBE * ax * co;
            double turn = -TUBE * co * per_length * (t[0] * ax + t[2] * az);
            for (int k = 0; k < 4; k++) {
                of_px[k] += t[0] * b[k] + turn * az * d[k];
                of_pz[k] += t[2] * b[k] - turn * ax * d[k];
            }
        }
        for (int k = 0; k < 3; k++) {
            sum[k] += w[k];
            for (int l = 0; l < 3; l++) moments[k][l] += w[k] * p[l];
        }
    }
    for (int k = 0; k < 3; k++) gradient[X + k] += sum[k];
    for (int angle = 0; angle < 3; angle++)
        for (int k = 0; k < 3; k++)
            for (int l = 0; l < 3; l++) gradient[ALPHA + angle] += moments[k][l] * c->by_angle[angle][k][l];
    if (part == 2) {
        by_shape = h * (of_pz[0] * c->dfirst + of_pz[3] * c->dlast);
        by_r = sum4(of_px, c->px), by_h = sum4(of_pz, c->pz);
        gradient[H1] += r * of_px[0] + h * of_pz[0] * (3 + x[SHAPE]) * c->first / x[H1];
        gradient[H2A] += r * of_px[1], gradient[H2B] += h * of_pz[1];
        gradient[H3A] += r * of_px[2], gradient[H3B] += h * of_pz[2];
        gradient[H4] += r * of_px[3] + h * of_pz[3] * (3 + x[SHAPE]) * c->last / x[H4];
    }
    gradient[SHAPE] += by_shape, gradient[R] += by_r, gradient[H] += by_h;
}

static void point_of_row(const cup *c, int part, double v, row *q) {
    if (part == 0) outside(c, v, 0, q);
    else if (part == 1) inside(c, v, 0, q);
    else handle(c, v, 0, q);
}

/* Points of a part on a grid: out[rows][columns][3]. */
void cup_grid(const double *x, int part, const double *u, int columns, const double *v, int rows, double *restrict out) {
    double cosines[MAX_COLUMNS], sines[MAX_COLUMNS];
    cup c;
    prepare(x, &c);
    for (int i = 0; i < columns; i++) cosines[i] = cos(2 * M_PI * u[i]), sines[i] = sin(2 * M_PI * u[i]);
    for (int j = 0; j < rows; j++) {
        row q;
        vec p, a, b;
        point_of_row(&c, part, v[j], &q);
        turned(c.m, q.cx, 0, q.cz, p);
        turned(c.m, q.ax, 0, q.az, a);
        turned(c.m, 0, q.by, 0, b);
        double p0 = p[0] + x[X], p1 = p[1] + x[Y], p2 = p[2] + x[Z];
        for (int i = 0; i < columns; i++) {
            out[3 * i] = p0 + a[0] * cosines[i] + b[0] * sines[i];
            out[3 * i + 1] = p1 + a[1] * cosines[i] + b[1] * sines[i];
            out[3 * i + 2] = p2 + a[2] * cosines[i] + b[2] * sines[i];
        }
        out += 3 * columns;
    }
}
