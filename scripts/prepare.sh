# shellcheck shell=bash
# Finds what building and running Canopy needs on Debian and its relatives, and installs what is missing where this
# user may, or prints the one line that does. Sourced by ./run and ./test; call prepare with what is wanted:
#   prepare build          C and C++ compilers, Rust
#   prepare lint           rustfmt and clippy
#   prepare vulkan         Vulkan loader and a driver (Mesa's lavapipe where there is no GPU)
#   prepare window         the X11 libraries that a window loads
#   prepare display        a display in memory (Xvfb) for tests of a window, where it can be installed: they are skipped else

# As in Cargo.toml.
rust_needed=1.95
missing=()

say() {
    printf '%s\n' "$*" >&2
}

die() {
    say "error: $*"
    exit 1
}

has_display() {
    [[ -n "${DISPLAY:-}" || -n "${WAYLAND_DISPLAY:-}" ]]
}

# A device that a Vulkan driver other than a software one could use.
has_gpu() {
    compgen -G '/dev/dri/renderD*' >/dev/null || [[ -e /dev/nvidiactl ]]
}

has_library() {
    local folder
    if PATH="$PATH:/sbin:/usr/sbin" ldconfig -p 2>/dev/null | grep -F "$1" >/dev/null; then
        return 0
    fi
    for folder in /lib /usr/lib /usr/lib64 /usr/local/lib /usr/lib/*-linux-gnu; do
        [[ -e "$folder/$1" ]] && return 0
    done
    return 1
}

# Whether a Vulkan driver whose manifest's name matches $1 (a glob) is installed.
has_vulkan_driver() {
    local folder
    for folder in /usr/share/vulkan/icd.d /usr/local/share/vulkan/icd.d /etc/vulkan/icd.d \
        "${XDG_DATA_HOME:-${HOME:-/nonexistent}/.local/share}/vulkan/icd.d"; do
        compgen -G "$folder/$1" >/dev/null && return 0
    done
    return 1
}

need_package() {
    local package
    for package in "$@"; do
        [[ " ${missing[*]-} " == *" $package "* ]] || missing+=("$package")
    done
}

find_build_tools() {
    if ! command -v cc >/dev/null || ! command -v c++ >/dev/null; then
        need_package build-essential
    fi
    if ! find_rust && ! command -v rustup >/dev/null && ! command -v curl >/dev/null; then
        need_package curl ca-certificates
    fi
}

find_vulkan() {
    # With one software driver there is nothing to select, and Mesa's layer for it complains where no Wayland display is.
    has_gpu || export NODEVICE_SELECT="${NODEVICE_SELECT:-1}"
    has_library libvulkan.so.1 || need_package libvulkan1
    # Who names the drivers knows better.
    if [[ -n "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}" ]]; then
        return
    fi
    if has_gpu; then
        has_vulkan_driver '*.json' || need_package mesa-vulkan-drivers
    else
        has_vulkan_driver 'lvp_icd*.json' || need_package mesa-vulkan-drivers
    fi
}

find_window_libraries() {
    has_library libX11.so.6 || need_package libx11-6
    has_library libX11-xcb.so.1 || need_package libx11-xcb1
    has_library libXcursor.so.1 || need_package libxcursor1
    has_library libXi.so.6 || need_package libxi6
    has_library libXrandr.so.2 || need_package libxrandr2
    has_library libxkbcommon-x11.so.0 || need_package libxkbcommon-x11-0
}

find_display_server() {
    if ! command -v Xvfb >/dev/null && command -v apt-get >/dev/null && may_install; then
        need_package xvfb
    fi
}

may_install() {
    [[ "$(id -u)" == 0 ]] || { command -v sudo >/dev/null && sudo -n true 2>/dev/null; }
}

install_packages() {
    ((${#missing[@]})) || return 0
    local line="apt-get update && apt-get install -y --no-install-recommends ${missing[*]}"
    if ! command -v apt-get >/dev/null; then
        die "this needs what Debian calls ${missing[*]}; please install it with this system's package manager"
    fi
    if [[ "$(id -u)" == 0 ]]; then
        say "installing ${missing[*]}"
        sh -c "export DEBIAN_FRONTEND=noninteractive; $line" >&2 || die "could not install; the line was: $line"
    elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
        say "installing ${missing[*]} (with sudo)"
        sudo -n env DEBIAN_FRONTEND=noninteractive sh -c "$line" >&2 || die "could not install; the line was: $line"
    else
        say "Missing: ${missing[*]}. This line installs it:"
        say "  sudo sh -c '$line'"
        exit 1
    fi
    missing=()
}

# Whether version $1 is at least version $2.
is_at_least() {
    printf '%s\n%s\n' "$2" "$1" | sort -V -C
}

# Puts cargo on the path where rustup put it, and checks its version.
find_rust() {
    if ! command -v cargo >/dev/null && [[ -x "${CARGO_HOME:-${HOME:-}/.cargo}/bin/cargo" ]]; then
        PATH="${CARGO_HOME:-${HOME:-}/.cargo}/bin:$PATH"
        export PATH
    fi
    local version
    version="$(rustc --version 2>/dev/null | cut -d ' ' -f 2)" || return 1
    command -v cargo >/dev/null && [[ -n "$version" ]] && is_at_least "$version" "$rust_needed"
}

install_rust() {
    find_rust && return
    local installer='curl --proto =https --tlsv1.2 -sSf https://sh.rustup.rs'
    if command -v rustup >/dev/null; then
        say "installing Rust $rust_needed (with rustup)"
        rustup toolchain install "$rust_needed" --profile minimal -c rustfmt -c clippy >&2 ||
            die "could not install Rust; the line was: rustup toolchain install $rust_needed"
        export RUSTUP_TOOLCHAIN="$rust_needed"
    else
        say "installing Rust $rust_needed in ${CARGO_HOME:-$HOME/.cargo} (from rustup.rs)"
        $installer | sh -s -- -y --no-modify-path --profile minimal --default-toolchain "$rust_needed" \
            -c rustfmt -c clippy >&2 ||
            die "could not install Rust; the line was: $installer | sh -s -- -y --default-toolchain $rust_needed"
    fi
    find_rust || die "Rust $rust_needed or newer is needed and $(rustc --version 2>/dev/null || echo none) was found"
}

install_lint() {
    cargo fmt --version >/dev/null 2>&1 && cargo clippy --version >/dev/null 2>&1 && return
    command -v rustup >/dev/null || die "rustfmt and clippy are needed; please install them as you installed Rust"
    rustup component add rustfmt clippy >&2 || die "could not install; the line was: rustup component add rustfmt clippy"
}

prepare() {
    local wanted
    for wanted in "$@"; do
        case "$wanted" in
            build) find_build_tools ;;
            vulkan) find_vulkan ;;
            window) find_window_libraries ;;
            display) find_display_server ;;
            lint) ;;
            *) die "prepare: what is $wanted?" ;;
        esac
    done
    install_packages
    for wanted in "$@"; do
        case "$wanted" in
            build) install_rust ;;
            lint) install_lint ;;
        esac
    done
}

# Where cargo puts what it builds of the package in folder $1.
target_folder() {
    cargo metadata --format-version 1 --no-deps --offline --manifest-path "$1/Cargo.toml" |
        sed -n 's/.*"target_directory":"\([^"]*\)".*/\1/p'
}
