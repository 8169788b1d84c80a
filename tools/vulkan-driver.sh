# Sourced by the scripts that give a shell Vulkan drivers.

# Writes the file by which Vulkan's loader finds a driver: its name, the driver's library and the version of Vulkan that it has.
write_driver() {
    local text='{"file_format_version": "1.0.0", "ICD": {"library_path": "'$2'", "api_version": "'$3'"}}' new
    [ "$text" != "$(cat "$1" 2>/dev/null)" ] || return 0
    # In one step, so that a loader never reads half of it.
    new=$(mktemp "$1.XXXXXX")
    echo "$text" >"$new"
    mv -f "$new" "$1"
}
