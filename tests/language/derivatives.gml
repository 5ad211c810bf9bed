// --- wrong primes
fn f(u: real, v: real) -> real = u * v
// Error: 9-11 'f' has 2 arguments: say in which one to derive
// Hint: name it after the prime, as in f'u
let a = f'(1, 2)
// Error: 11-12 'f' has no argument 'w' to derive in
// Hint: its arguments are u, v
let b = f'w(1, 2)
// Error: 12-13 a prime must directly follow what it differentiates, as in f' or s'u
// Hint: texts are written in double quotes
let c = 3.0'
// Error: 23-24 the result of 'g' must be a whole number, but this is a bare number
fn g(n: int) -> int = n
let d = g'(3)
