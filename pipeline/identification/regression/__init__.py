"""The least-squares problem: design matrix, normal equations, tolerances, intervals."""
