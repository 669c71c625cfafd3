#!/bin/sh
# Installs what some tests need beside Python: a real sshd, ip and tc, and a browser. Tests that lack them are skipped,
# and say so; with CI in the environment those that lack the browser fail.
# It is for machines that run the tests for others (.ci/run calls it); no other target of the Makefile does. It needs
# root and apt-get, and does nothing where it has not both, or where nothing is missing. It starts no service.
set -u

missing=
[ -x /usr/sbin/sshd ] || missing="$missing openssh-server"
command -v ssh >/dev/null || missing="$missing openssh-client"
command -v ip >/dev/null || missing="$missing iproute2"
found=
for name in chromium chromium-browser google-chrome google-chrome-stable; do
    ! command -v "$name" >/dev/null || found=yes
done
[ -n "$found" ] || missing="$missing chromium"
[ -n "$missing" ] || exit 0

if [ "$(id -u)" != 0 ] || ! command -v apt-get >/dev/null; then
    echo "Not installed, so some tests are skipped:$missing"
    exit 0
fi

# Debian starts what it installs, unless this file says no.
policy=/usr/sbin/policy-rc.d
made=
if [ ! -e "$policy" ]; then
    printf '#!/bin/sh\nexit 101\n' >"$policy" && chmod 755 "$policy" && made=yes
fi
export DEBIAN_FRONTEND=noninteractive
# shellcheck disable=SC2086  # several words are meant
apt-get install --yes --quiet --no-install-recommends $missing >/dev/null 2>&1 ||
    { apt-get update --quiet && apt-get install --yes --quiet --no-install-recommends $missing; } >/dev/null 2>&1 ||
    echo "Could not be installed, so some tests are skipped:$missing"
[ -z "$made" ] || rm -f "$policy"
