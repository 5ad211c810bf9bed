//! Scans: reading, cleaning, normals, noise; and the virtual laser scanner.
