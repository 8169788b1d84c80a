# For the scripts that give a shell Vulkan drivers, which source it.

# Writes a file by which Vulkan's loader finds a driver: the file, the driver's library, and its version of Vulkan.
write_driver() {
    local text='{"file_format_version": "1.0.0", "ICD": {"library_path": "'$2'", "api_version": "'$3'"}}' new
    [ "$text" != "$(cat "$1" 2>/dev/null)" ] || return 0
    # In one step, so that no loader reads half of it.
    new=$(mktemp "$1.XXXXXX")
    echo "$text" >"$new"
    mv -f "$new" "$1"
}
