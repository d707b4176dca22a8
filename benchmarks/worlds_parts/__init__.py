"""What `bench.sh worlds` runs in each world, and the random worlds themselves."""
