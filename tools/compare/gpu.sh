# shellcheck shell=bash disable=SC2154
# The groups of tools/compare-hardware.sh that ask OpenCL and Vulkan.

# The best figure of a test of clpeak on the CPU, over all widths of its vectors.
clpeak_best() {
    awk -v test="$1" '
        /^Platform:/ { on_cpu = /Portable Computing Language/; inside = 0 }
        index($0, test) { inside = on_cpu; next }
        inside && !/:/ { inside = 0 }
        inside { split($0, field, ":"); if (field[2] + 0 > best) best = field[2] + 0 }
        END { if (best) print best }' "$work/theirs.out"
}

# Debian's clpeak knows OpenCL only; the Vulkan tests are of later versions. Through PoCL it measures the CPU.
group_opencl() {
    have clpeak "Debian: clpeak and pocl-opencl-icd" || return
    if ! take theirs clpeak --global-bandwidth || [ -z "$(clpeak_best "Global memory bandwidth")" ]; then
        say "left out: OpenCL has no CPU here (Debian: pocl-opencl-icd)"
        return 1
    fi
    ours memory || return
    pair bandwidth_all_threads_gb_per_s "clpeak on PoCL, best width" "$(value bandwidth_all_threads_gb_per_s)" \
        "$(clpeak_best "Global memory bandwidth")" "clpeak only reads, and adds what it reads in one dependent chain a work-item"
}

# A figure of the GPU of that name from the text of vulkaninfo, in decimal. The first one where it stands there twice.
vulkan_figure() {
    awk -v name="$1" -v key="$2" '
        /^GPU[0-9]+:/ { ours = 0 }
        $1 == "deviceName" && substr($0, index($0, "= ") + 2) == name { ours = 1 }
        ours && $1 == key && $2 == "=" { print $3; exit }' "$work/theirs.out"
}

# Bytes of the device-local heaps of the GPU of that name.
vulkan_heaps() {
    awk -v name="$1" '
        /^GPU[0-9]+:/ { ours = 0 }
        $1 == "deviceName" && substr($0, index($0, "= ") + 2) == name { ours = 1 }
        /^memoryTypes:/ { heaps = 0 }
        /^memoryHeaps:/ { heaps = ours }
        heaps && $1 == "size" { size = $3 }
        heaps && $1 == "MEMORY_HEAP_DEVICE_LOCAL_BIT" { sum += size }
        END { if (sum) printf "%.0f\n", sum }' "$work/theirs.out"
}

group_vulkan() {
    have vulkaninfo "Debian: vulkan-tools" || return
    take theirs vulkaninfo || return
    take gpus part gpus || return
    local line index name gpu
    while read -r line; do
        index=$(grep -o '"index":[0-9]*' <<<"$line" | grep -o '[0-9]*$') || continue
        name=$(grep -o '"name":"[^"]*"' <<<"$line" | sed 's/^"name":"//; s/"$//')
        gpu="gpu$index"
        if [ -z "$(vulkan_figure "$name" deviceName)" ]; then
            say "left out: vulkaninfo knows no $name, which is $gpu"
            continue
        fi
        take ours part gpu "$index" || continue
        pair "$gpu memory_bytes" vulkaninfo "$(value memory_bytes)" "$(vulkan_heaps "$name")" "NVML and amdgpu tell more exactly"
    done <"$work/gpus.out"
}
