fn area_of(side: length) = _half(2 * side * side)

fn _half(x) = x / 2
