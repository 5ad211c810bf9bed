let thickness = 3mm

/// An angle of two plates.
fn bracket(width: length) = {base: plane(width, width), wall: plane(width, width).rotate(90deg, (1, 0, 0))}
