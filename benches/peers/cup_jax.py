"""The cup of examples/cup/cup.gml in JAX, double precision, one thread: how long points, Jacobian and pullback take.

    python -m venv jax && jax/bin/pip install jax
    taskset -c 0 jax/bin/python benches/peers/cup_jax.py

The scattered points, the parameters and the unit (microseconds, the least of many runs) are those of `cargo bench --bench cup`.
"""
import os

os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
import time

import jax
import jax.numpy as jnp

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_platforms", "cpu")

X = jnp.array([3.0, -2.0, 5.0, 0.2, -0.3, 0.4, 1.2, 41.0, 92.0, 0.93, 1.85, 0.97, 1.75, 0.22, 0.78])


def scattered(count):
    """Points that fill the square evenly, in no order."""
    i = jnp.arange(count)
    return (0.5 + i * 0.7548776662466927) % 1, (0.5 + i * 0.5698402909980533) % 1


OUTSIDE, INSIDE, HANDLE = scattered(28000), scattered(26000), scattered(12191)


def rotation(alpha, beta, gamma):
    ca, sa, cb, sb, cc, sc = (f(t) for t in (alpha, beta, gamma) for f in (jnp.cos, jnp.sin))
    return jnp.array([
        [cb * cc, sa * sb * cc - ca * sc, ca * sb * cc + sa * sc],
        [cb * sc, sa * sb * sc + ca * cc, ca * sb * sc - sa * cc],
        [-sb, sa * cb, ca * cb],
    ])


def placed(x, u, rows):
    """Points c + a cos + b sin of rows (cx, cz, ax, az, by), in place."""
    cx, cz, ax, az, by = rows
    c, s = jnp.cos(2 * jnp.pi * u), jnp.sin(2 * jnp.pi * u)
    p = jnp.stack([cx + ax * c, by * s, cz + az * c], -1)
    return x[:3] + p @ rotation(x[3], x[4], x[5]).T


def power(t, n):
    """t^n, with the derivative 0 by n at t = 0."""
    safe = jnp.where(t > 0, t, 1.0)
    return jnp.where(t > 0, safe**n, 0.0)


def cup(x):
    shape, r, h = x[6], x[7], x[8]
    u, v = OUTSIDE
    zero = jnp.zeros_like(v)
    outside = placed(x, u, (zero, h * power(v, 3 + shape), r * v, zero, r * v))
    u, v = INSIDE
    zero = jnp.zeros_like(v)
    rim = (24 / 25) ** (1 / (2 + shape)) - 0.1
    t = rim * (1 - v)
    inside = placed(x, u, (zero, h * (1 / 25 + (t + 0.1) ** (2 + shape)), r * t, zero, r * t))
    u, v = HANDLE
    w = 1 - v
    px = r * jnp.array([x[9], x[10], x[12], x[14]])
    pz = h * jnp.array([x[9] ** (3 + shape), x[11], x[13], x[14] ** (3 + shape)])
    b = jnp.stack([w**3, 3 * w * w * v, 3 * w * v * v, v**3])
    d = jnp.stack([-3 * w * w, 3 * w * w - 6 * w * v, 6 * w * v - 3 * v * v, 3 * v * v])
    tx, tz = px @ d, pz @ d
    length = jnp.sqrt(tx * tx + tz * tz)
    handle = placed(x, u, (px @ b, pz @ b, 5 * tz / length, -5 * tx / length, jnp.full_like(v, 5.0)))
    return jnp.concatenate([p.reshape(-1, 3) for p in (outside, inside, handle)])


def least(f, *args):
    f(*args).block_until_ready()
    best, end = float("inf"), time.perf_counter() + 3
    while time.perf_counter() < end:
        start = time.perf_counter()
        f(*args).block_until_ready()
        best = min(best, time.perf_counter() - start)
    return 1e6 * best


def main():
    weights = jnp.sin(jnp.arange(66191)[:, None] * jnp.array([0.5, 1.3, 2.1]))
    print(f"jax {jax.__version__}, us")
    print(f"points    {least(jax.jit(cup), X):10.1f}")
    print(f"Jacobian  {least(jax.jit(jax.jacfwd(cup)), X):10.1f}")
    print(f"pullback  {least(jax.jit(lambda x, w: jax.vjp(cup, x)[1](w)[0]), X, weights):10.1f}")


if __name__ == "__main__":
    main()
