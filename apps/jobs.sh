#!/bin/sh
# Prints how many compilers may run at once: one per processor, but 2 GiB of free memory for each, as a source that
# includes OpenVDB takes up to that much.
awk -v cpus="$(nproc)" '/^MemAvailable:/ { n = int($2 / 2097152) }
  END { if (n > cpus) n = cpus; print (n < 1) ? 1 : n }' /proc/meminfo
