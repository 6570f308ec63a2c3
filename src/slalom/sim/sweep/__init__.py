"""Many runs: cases, processes, stored results, tables."""
