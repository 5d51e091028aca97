#!/bin/bash
# {{ study }}: one of {{ elements }} parts of its surfaces.
# Written by `asperity submit {{ manifest }}`.
#SBATCH --job-name={{ study }}
#SBATCH --array={{ array }}
#SBATCH --output={{ logs }}/%A_%a.txt
{{ common }}

# A minute before its time is up, Slurm sends SIGTERM; `exec` makes sure that asperity gets it.
exec "$program" --data "$data" run "$manifest" \
    --shard "$SLURM_ARRAY_TASK_ID/{{ elements }}" --job "${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID" \
    --jobs {{ cores }} --memory {{ memory }}{{ " --replace" if replace }}
