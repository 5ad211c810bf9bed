fn bracket(x) = x
