# scripts/lib.sh: what the scripts share; sourced, not run. Sets `root` and goes there.
root=$(cd "$(dirname "$0")/.." && pwd)
cd "$root"

# "usage" prints the comment at the top of the calling script.
usage() { sed -n '2,/^[^#]/{/^#/s/^# \{0,1\}//p}' "$0"; }

case ${1-} in
    -h | --help) usage; exit 0 ;;
esac

# Lets clones in different places share what ccache holds.
export CCACHE_BASEDIR="${CCACHE_BASEDIR:-$root}"

# configure PRESET [ARGS...]: quiet unless it fails; with ccache where that is installed, and without it with
# precompiled headers.
configure() {
    preset=$1
    shift
    if command -v ccache >/dev/null; then
        set -- -DCMAKE_CXX_COMPILER_LAUNCHER=ccache "$@"
    elif [ "$preset" != tidy ]; then
        set -- -DELLICAST_PRECOMPILE=ON "$@"
    fi
    mkdir -p "build/$preset"
    cmake --preset "$preset" "$@" >"build/$preset/configure.log" 2>&1 ||
        { cat "build/$preset/configure.log"; exit 1; }
    grep -A3 -i warning "build/$preset/configure.log" || true
}

# build PRESET [TARGETS...]: as many jobs as cores.
build() {
    preset=$1
    shift
    cmake --build "build/$preset" -j "$(nproc)" ${1:+--target "$@"}
}

# run_tests PRESET [CTEST ARGS...]
run_tests() {
    preset=$1
    shift
    ctest --test-dir "build/$preset" --output-on-failure -j "$(nproc)" "$@"
}
