let a = (1 +
