/* Surfaces whose sines, powers and exponentials depend on both u and v, as one would write them by hand. Points are x, y, z each,
 * row after row (u runs fastest). The parameters are a, b, k and n of benches/cup/waves.rs. */
#include <math.h>

typedef double height(const double *x, double u, double v);

static double sine(const double *x, double u, double v) { return x[0] * sin(x[2] * u * v + x[1]); }

static double both(const double *x, double u, double v) {
    double t = x[2] * u * v + x[1];
    return x[0] * sin(t) * (1 + cos(t));
}

static double power(const double *x, double u, double v) { return x[0] * pow(u + v + x[1], x[3]); }

static double exponential(const double *x, double u, double v) { return x[0] * exp(-x[2] * u * v); }

static inline void grid(height *f, const double *x, const double *u, int nu, const double *v, int nv, double *out) {
    for (int i = 0; i < nv; i++) {
        for (int j = 0; j < nu; j++, out += 3) {
            out[0] = 60 * u[j];
            out[1] = 60 * v[i];
            out[2] = f(x, u[j], v[i]);
        }
    }
}

void wave_points(const double *x, int kind, const double *u, int nu, const double *v, int nv, double *out) {
    switch (kind) {
    case 0: grid(sine, x, u, nu, v, nv, out); break;
    case 1: grid(both, x, u, nu, v, nv, out); break;
    case 2: grid(power, x, u, nu, v, nv, out); break;
    default: grid(exponential, x, u, nu, v, nv, out); break;
    }
}
