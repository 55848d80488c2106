# Renders one part of one frame. program scene output parts part options [frame]
set -eu
program=$1 scene=$2 output=$3 parts=$4 part=$5 frame=${7-}
# The options are words as a shell reads them.
eval "set -- $6"
set -- render "$scene" --recover --progress openjd "$@"
[ -z "$frame" ] || set -- "$@" "--frames=$frame"
if [ "$parts" -gt 1 ]; then
    folder=${output%/*}/parts name=${output##*/}
    mkdir -p -- "$folder"
    set -- "$@" --part "$part/$parts" -o "$folder/${name%.*}.$part-of-$parts.exr"
else
    set -- "$@" -o "$output"
fi
# In place of this shell, so that it is the render that is told to stop.
exec "$program" "$@"
