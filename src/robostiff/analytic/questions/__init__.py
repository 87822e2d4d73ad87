"""What a formula says: rank, free motions, eigenvalues, loci of singularities."""
