use "circle_a.gml" (a)
let b = a
