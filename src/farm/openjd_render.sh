# Renders one part of one frame; part 0 is the lesson of the others. program scene output parts part taught options [frame]
set -eu
program=$1 scene=$2 output=$3 parts=$4 part=$5 taught=$6 frame=${8-}
if [ "$parts" -le 1 ] && [ "$part" -eq 0 ]; then
    echo "There is one part: it learns for itself."
    exit
fi
# The options are words as a shell reads them.
eval "set -- $7"
set -- render "$scene" --recover --progress openjd "$@"
[ -z "$frame" ] || set -- "$@" "--frames=$frame"
if [ "$parts" -gt 1 ]; then
    folder=${output%/*}/parts name=${output##*/}
    name=${name%.*}
    mkdir -p -- "$folder"
    if [ "$part" -eq 0 ]; then
        set -- "$@" --save-cache "$folder/$name.lesson"
    elif [ "$taught" = yes ]; then
        # Nothing more is learned, so that the samples of all parts are points of one sequence.
        set -- "$@" --load-cache "$folder/$name.lesson" --freeze-cache
    fi
    set -- "$@" --part "$part/$parts" -o "$folder/$name.$part-of-$parts.exr"
else
    set -- "$@" -o "$output"
fi
# In place of this shell, so that it is the render that is told to stop.
exec "$program" "$@"
