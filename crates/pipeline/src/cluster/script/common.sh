#SBATCH --ntasks=1
#SBATCH --cpus-per-task={{ cores }}
#SBATCH --mem={{ mebibytes }}M
#SBATCH --time={{ minutes }}
#SBATCH --signal=B:TERM@60
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
    echo "error: $(hostname) has no $program: install asperity where all nodes see it," \
        "or say with \`--program\` or \`before\` where it is" >&2
    exit 127
fi
if [ ! -d "$data/cluster/{{ study }}" ]; then
    echo "error: $(hostname) has no $data: it must be on a file system that all nodes share;" \
        "name another with \`--data\`" >&2
    exit 1
fi
