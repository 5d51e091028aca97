#!/bin/bash
# {{ study }}: what comes after its elements. Computes what is little, submits again what is much,
# and in the end writes the tables. Its argument is the round, from 0 on.
# Written by `asperity submit {{ manifest }}`.
#SBATCH --job-name={{ study }}-finish
#SBATCH --output={{ logs }}/finish-%j.txt
{{ common }}

exec "$program" --data "$data" finish "$manifest" --round "${1:-0}" \
    --jobs {{ cores }} --memory {{ memory }}{{ " --report" if report }}{{ " --replace" if replace }}
