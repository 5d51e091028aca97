#SBATCH --ntasks=1
#SBATCH --cpus-per-task={{ cores }}
#SBATCH --mem={{ mebibytes }}M
#SBATCH --time={{ minutes }}
#SBATCH --signal=B:TERM@60
#SBATCH --open-mode=append
{% for directive in directives %}
#SBATCH {{ directive }}
{% endfor %}

{% for line in before %}
{{ line }}
{% endfor %}
program={{ program }}
data={{ data }}
manifest={{ path }}

if ! command -v "$program" > /dev/null; then
    echo "error: cannot find $program on $(hostname): install asperity on a file system that all" \
        "nodes share, or set its path with \`--program\` or \`before\`" >&2
    exit 127
fi
if [ ! -d "$data/cluster/{{ study }}" ]; then
    echo "error: cannot find $data on $(hostname): put the data folder on a file system that all" \
        "nodes share, and name it with \`--data\`" >&2
    exit 1
fi
