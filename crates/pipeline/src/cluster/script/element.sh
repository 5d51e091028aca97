#!/bin/bash
# Computes one of {{ elements }} parts of the surfaces of study {{ study }}.
# Written by `asperity submit {{ manifest }}`.
#SBATCH --job-name={{ study }}
#SBATCH --array={{ array }}
#SBATCH --output={{ logs }}/%A_%a.txt
{{ common }}

# Slurm sends SIGTERM one to two minutes before the time limit; `exec` passes it on to asperity.
exec "$program" --data "$data" run "$manifest"{{ settings }} \
    --shard "$SLURM_ARRAY_TASK_ID/{{ elements }}" --job "${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID" \
    --jobs {{ cores }} --memory {{ memory }}{{ " --replace" if replace }}
