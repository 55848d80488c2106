# Prints a name with the number of the frame in place of each stretch of "#", in at least as many digits.
numbered() {
    whole='' rest=$1
    while [ "${rest%%#*}" != "$rest" ]; do
        before=${rest%%#*}
        rest=${rest#"$before"}
        marks=${rest%%[!#]*}
        rest=${rest#"$marks"}
        width=${#marks}
        [ "$frame" -ge 0 ] || width=$((width + 1))
        whole=$whole$before$(printf "%0${width}d" "$frame")
    done
    printf '%s' "$whole$rest"
}
