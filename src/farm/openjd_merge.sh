# Merges the parts of one frame; part 0 is the lesson, where they were taught. program output parts taught keep [frame]
set -eu
program=$1 output=$2 parts=$3 taught=$4 keep=$5 frame=${6-}
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
[ "$taught" != yes ] || part=0
while [ "$part" -le "$parts" ]; do
    set -- "$@" "$names.$part-of-$parts.exr"
    part=$((part + 1))
done
"$program" merge "$@" -o "$output"
[ "$keep" = yes ] || rm -f -- "$@" "$names.lesson"
