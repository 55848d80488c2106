# Merges the parts of one frame; part 0 is the lesson, where they were taught. program output parts taught keep png [frame]
set -eu
program=$1 output=$2 parts=$3 taught=$4 keep=$5 png=$6 frame=${7-}
[ "$png" != no ] || png=
if [ "$parts" -le 1 ]; then
    echo "There is one part: the image is there."
    exit
fi
name=${output##*/}
names=${output%/*}/parts/${name%.*}
if [ -n "$frame" ]; then
    output=$(numbered "$output")
    names=$(numbered "$names")
    png=$(numbered "$png")
fi
set --
part=1
[ "$taught" != yes ] || part=0
while [ "$part" -le "$parts" ]; do
    set -- "$@" "$names.$part-of-$parts.exr"
    part=$((part + 1))
done
"$program" merge "$@" -o "$output" ${png:+--png "$png"}
[ "$keep" = yes ] || rm -f -- "$@" "$names.lesson"
