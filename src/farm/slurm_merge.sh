set -eu
# Which frames; a still is frame 0, and no name has a place for that.
frame=0 to=0
if [ -n "$first" ]; then
    frame=$((first + SLURM_ARRAY_TASK_ID * frames_per_task))
    to=$((frame + frames_per_task - 1))
    [ "$to" -le "$last" ] || to=$last
fi
while [ "$frame" -le "$to" ]; do
    image=$output names=$part_names picture=$png
    if [ -n "$first" ]; then
        image=$(numbered "$output")
        names=$(numbered "$part_names")
        picture=$(numbered "$png")
    fi
    set --
    part=$first_part
    while [ "$part" -le "$parts" ]; do
        set -- "$@" "$names.$part-of-$parts.exr"
        part=$((part + 1))
    done
    # The first part is the first to be removed: where it is missing and the image is there, the task did this frame before it was requeued.
    if [ -e "$1" ] || [ ! "$image" -nt "$script" ]; then
        "$program" merge "$@" -o "$image" ${picture:+--png "$picture"}
    fi
    [ -n "$keep_parts" ] || rm -f -- "$@" "$names.lesson"
    frame=$((frame + 1))
done
