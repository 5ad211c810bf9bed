//! Machine code for IR functions, by Cranelift.
