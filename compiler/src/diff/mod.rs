//! Derivatives of IR functions, as IR functions: tangent, Jacobian, pullback.
