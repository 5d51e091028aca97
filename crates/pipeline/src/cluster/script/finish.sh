#!/bin/bash
# Finishes study {{ study }} after its array elements: computes small remainders, resubmits large
# ones, and finally writes the tables. Its argument is the number of the round, from 0.
# Written by `asperity submit {{ manifest }}`.
#SBATCH --job-name={{ study }}-finish
#SBATCH --output={{ logs }}/finish-%j.txt
{{ common }}

exec "$program" --data "$data" finish "$manifest"{{ settings }} --round "${1:-0}" \
    --jobs {{ cores }} --memory {{ memory }}{{ " --report" if report }}{{ " --replace" if replace }}
