#!/bin/sh
# `python -m benchmarks.accelerator` on a bare machine with a GPU that nothing can be fetched on.
#
#     sh benchmarks/accelerator.sh KIT [options of benchmarks.accelerator]
#
# What the machine lacks comes along in the folder KIT; each part may be left out:
#   site/     Python packages, put before the machine's own
#   cache/    the baked bodies and the pose network, as in the user's cache
#   mesa/     a software OpenGL for the CPU's column: libEGL_mesa.so.0 and what it needs, dri/ with its drivers
#   loaders/  Debian packages of libEGL.so.1 and libGL.so.1, unpacked into the system where it has none (as root)
set -eu
kit=$(cd "$1" && pwd)
shift
cd "$(dirname "$0")/.."

found() { ldconfig -p | grep -q "$1"; }
if [ -d "$kit/loaders" ] && ! { found 'libEGL\.so\.1' && found 'libGL\.so\.1'; }; then
    for package in "$kit"/loaders/*.deb; do dpkg -x "$package" /; done
    ldconfig
fi
if [ -d "$kit/mesa" ]; then
    printf '{"file_format_version": "1.0.0", "ICD": {"library_path": "%s"}}\n' "$kit/mesa/libEGL_mesa.so.0" \
        > "$kit/mesa/50_mesa.json"
    export __EGL_VENDOR_LIBRARY_DIRS="$kit/mesa" LIBGL_DRIVERS_PATH="$kit/mesa/dri"
fi
[ ! -d "$kit/cache" ] || export VANTAGE_CACHE="$kit/cache"
export PYTHONPATH="$PWD:$kit/site${PYTHONPATH:+:$PYTHONPATH}"
# CUDA's libraries come with PyTorch as Python packages, where ONNX Runtime does not look for them by itself.
packages=$(python3 -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
if [ -d "$packages/nvidia" ]; then
    libraries=$(find "$packages/nvidia" -name '*.so*' -exec dirname {} \; | sort -u | paste -sd: -)
    export LD_LIBRARY_PATH="$libraries${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
fi
exec python3 -m benchmarks.accelerator "$@"
