#!/usr/bin/env bash
# Compiles the shaders of this folder to SPIR-V: compile.sh OUTPUT_FOLDER.
# The compilers come from two Python packages, which carry them as programs and libraries for Linux on x86-64:
# slangtorch has slangc 2026.14.1, compushady-lrtu has the library of DXC 1.8. LVK_SLANGC and LVK_DXC_LIBRARY name
# others. slangc optimises with a library that its package lacks, hence -O0.
set -euo pipefail
out=$(realpath "$1")
cd "$(dirname "${BASH_SOURCE[0]}")"
include=../../../lvk/src/shader/hlsl

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

# Unpacks a package: its name and version.
unpack() {
    pip download --quiet --disable-pip-version-check --no-deps --only-binary :all: --dest "$scratch" "$1"
    python3 -m zipfile -e "$scratch/${1%%=*}"*.whl "$scratch"
}

slangc=${LVK_SLANGC:-}
if [[ -z $slangc ]]; then
    unpack slangtorch==1.3.22
    slangc=$scratch/slangtorch/bin/slangc
    chmod +x "$slangc"
fi
dxc=${LVK_DXC_LIBRARY:-}
if [[ -z $dxc ]]; then
    unpack compushady_lrtu==0.18.0
    dxc=$scratch/compushady/backends/libdxcompiler_x86_64.so
fi

# 39001: arrays of several types share a binding. 41012: the profile is extended by what the shader uses.
compile_slang() {
    "$slangc" "$1" -I $include -O0 -warnings-disable 39001,41012 -target spirv -profile spirv_1_6 \
        -fvk-use-scalar-layout "${@:3}" -o "$out/$2.slang.spv"
}

compile_hlsl() {
    python3 dxc.py "$dxc" "$1.hlsl" "$out/$2.hlsl.spv" -spirv -fspv-target-env=vulkan1.3 -E main -I $include \
        -fvk-use-scalar-layout "${@:3}"
}

for shader in blend query; do
    compile_slang $shader.slang $shader -entry main -stage compute
    compile_hlsl $shader $shader -T cs_6_5
done
compile_slang helpers.hlsl helpers -entry main -stage fragment
compile_hlsl helpers helpers -T ps_6_5
compile_slang pipeline.slang pipeline.rgen -entry rayGen -stage raygeneration
compile_slang pipeline.slang pipeline.rmiss -entry miss -stage miss
compile_slang pipeline.slang pipeline.rchit -entry closestHit -stage closesthit
compile_hlsl pipeline pipeline.rgen -T lib_6_5 -D STAGE=0
compile_hlsl pipeline pipeline.rmiss -T lib_6_5 -D STAGE=1
compile_hlsl pipeline pipeline.rchit -T lib_6_5 -D STAGE=2
