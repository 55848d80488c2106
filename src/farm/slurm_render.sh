# Which part of which frames: tasks count from 0, and the parts of the first frames come first.
task=$SLURM_ARRAY_TASK_ID
part=$((task % parts + 1)) chunk=$((task / parts))
what="part $part of $parts"
set -- render "$scene" --recover "$@"
case $lesson in
    teaches)
        part=0 chunk=$task what="the lesson of $parts parts"
        set -- "$@" --save-cache "$part_names.lesson"
        ;;
    # Nothing more is learned, so that the samples of all parts are points of one sequence.
    taught) set -- "$@" --load-cache "$part_names.lesson" --freeze-cache ;;
esac
if [ -n "$first" ]; then
    from=$((first + chunk * frames_per_task))
    to=$((from + frames_per_task - 1))
    [ "$to" -le "$last" ] || to=$last
    what="$what, frames $from to $to"
    set -- "$@" "--frames=$from..$to"
fi
if [ "$parts" -gt 1 ]; then
    set -- "$@" --part "$part/$parts" -o "$part_names.$part-of-$parts.exr"
else
    set -- "$@" -o "$output"
fi

# As many threads and as much memory as the job was granted. Memory is counted in MiB, and Slurm ends what takes more: a tenth is left.
case $granted in
    *threads*) set -- "$@" --threads "${SLURM_CPUS_PER_TASK:-${SLURM_CPUS_ON_NODE:-1}}" ;;
esac
memory=${SLURM_MEM_PER_NODE:-0}
[ "$memory" -gt 0 ] || memory=$((${SLURM_MEM_PER_CPU:-0} * ${SLURM_CPUS_ON_NODE:-1}))
case $granted in
    *memory*) [ "$memory" -eq 0 ] || set -- "$@" --memory-limit "$((memory * 9 / 10))MiB" ;;
esac

# USR1 says that time is nearly up, TERM that Slurm wants the machine back or that the job is cancelled. Either way the render is told
# once, and ends with 130 when it has kept a checkpoint. TERM reaches all processes of a job, and a second request would end the render before
# that: so it does not listen to TERM.
render='' asked='' heard=yes
stop() {
    heard=yes
    if [ -z "$asked" ]; then
        asked=$1
        [ -z "$render" ] || kill -USR1 "$render" 2>/dev/null
    fi
}
trap 'stop time' USR1
trap 'stop end' TERM

restarts=${SLURM_RESTART_COUNT:-0}
echo "lanternfish: $what on ${SLURMD_NODENAME:-this machine}, restart $restarts" >&2
(
    trap '' TERM
    exec "$program" "$@"
) &
render=$!
[ -z "$asked" ] || kill -USR1 "$render"

# A signal ends the wait, but not the render: wait again. 127: the render has been waited for.
status=127
while [ -n "$heard" ]; do
    heard=''
    wait "$render"
    now=$?
    [ "$now" -eq 127 ] || status=$now
done

# What was stopped goes on from its checkpoint, and so does what was killed, a few times: the machine may be at fault, or short of
# memory. After TERM it is for Slurm to say whether the task goes on, and what ended by itself with an error would do so again.
again=0
if [ "$asked" != end ]; then
    if [ "$status" -eq 130 ]; then
        again=100
    elif [ "$status" -gt 128 ]; then
        again=5
    fi
fi
if [ "$restarts" -lt "$again" ]; then
    echo "lanternfish: ended with $status, to be requeued" >&2
    scontrol requeue "${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID"
fi
exit "$status"
