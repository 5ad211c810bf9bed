// Arrays, beside the built-in `len`, `sum`, `fold`, `min` and `max`, and `for x in xs { ... }`. Their lengths are known
// while compiling.

/// f of every element of xs.
/// ```gml
/// map([1, 2, 3], |x| x * x)   // = [1, 4, 9]
/// ```
fn map(xs, f) = for x in xs { f(x) }

/// `count` numbers (or points) from `from` to `to`, evenly spaced, both ends among them. `count` is 2 or more.
/// ```gml
/// steps(0mm, 3mm, 4)   // = [0, 1, 2, 3] mm
/// ```
fn steps(from, to, count: int) {
  require count > 1, "steps(from, to, count) gives both ends, which are two numbers at least"
  for i in 0..count { mix(from, to, i / (count - 1)) }
}

/// The elements of a, then those of b.
/// ```gml
/// concat([1, 2], [5])   // = [1, 2, 5]
/// ```
fn concat(a, b) = for i in 0..len(a) + len(b) { if i < len(a) { a[i] } else { b[i - len(a)] } }

/// The first element.
/// ```gml
/// first([4mm, 5mm])   // = 4 mm
/// ```
fn first(xs) = xs[0]

/// The last element.
/// ```gml
/// last([4mm, 5mm])   // = 5 mm
/// ```
fn last(xs) = xs[len(xs) - 1]

/// The elements from the index `from` up to but without `to`.
/// ```gml
/// slice([10, 11, 12, 13], 1, 3)   // = [11, 12]
/// ```
fn slice(xs, from: int, to: int) = for i in from..to { xs[i] }

/// The elements, the last one first.
/// ```gml
/// backwards([1, 2, 3])   // = [3, 2, 1]
/// ```
fn backwards(xs) = for i in 0..len(xs) { xs[len(xs) - 1 - i] }

/// Every element with the next: (xs[0], xs[1]), (xs[1], xs[2]), ...
/// ```gml
/// map(pairs([1, 4, 9]), |(a, b)| b - a)   // = [3, 5]
/// ```
fn pairs(xs) = for i in 0..len(xs) - 1 { (xs[i], xs[i + 1]) }

/// Every element of a with that of b at the same place.
/// ```gml
/// map(zip([1, 2], [3mm, 4mm]), |(a, b)| a * b)   // = [3, 8] mm
/// ```
fn zip(a, b) = for i in 0..len(a) { (a[i], b[i]) }

/// The sums of the first element, of the first two, and so on.
/// ```gml
/// running_sums([1mm, 2mm, 3mm])   // = [1, 3, 6] mm
/// ```
fn running_sums(xs) = for i in 0..len(xs) { sum(slice(xs, 0, i + 1)) }

/// The product of all elements.
/// ```gml
/// product([2, 3, 4])   // = 24
/// ```
fn product(xs) = fold(1, xs, |total, x| total * x)

/// The mean of all elements: of numbers, points or vectors.
/// ```gml
/// average([2mm, 3mm, 7mm])   // = 4 mm
/// ```
fn average(xs) = sum(xs) / len(xs)
