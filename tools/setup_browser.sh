# Sourced by test.sh after tools/setup.sh. Installs Debian's Chromium, in which tests open the pages
# of `python -m asperity report`. If it cannot be installed, these tests are left out.
if ! command -v chromedriver >/dev/null 2>&1 && command -v apt-get >/dev/null 2>&1; then
  sudo=
  [ "$(id -u)" = 0 ] || sudo=sudo
  echo "asperity: installing Debian packages: chromium chromium-driver" >&2
  for attempt in 1 2; do
    $sudo env DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends \
      chromium chromium-driver >/dev/null 2>&1 && break
    [ $attempt = 2 ] || $sudo apt-get update -qq || true
  done
  command -v chromedriver >/dev/null 2>&1 ||
    echo "asperity: no Chromium: the tests of pages in a browser are left out" >&2
fi
