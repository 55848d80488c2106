# Merges the parts of one frame. program output parts keep [frame]
set -eu
program=$1 output=$2 parts=$3 keep=$4 frame=${5-}
if [ "$parts" -le 1 ]; then
    echo "There is one part: the image is there."
    exit
fi
name=${output##*/}
names=${output%/*}/parts/${name%.*}
if [ -n "$frame" ]; then
    output=$(numbered "$output")
    names=$(numbered "$names")
fi
set --
part=1
while [ "$part" -le "$parts" ]; do
    set -- "$@" "$names.$part-of-$parts.exr"
    part=$((part + 1))
done
"$program" merge "$@" -o "$output"
[ "$keep" = yes ] || rm -f -- "$@"
