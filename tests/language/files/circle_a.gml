use "circle_b.gml" (b)
let a = b
