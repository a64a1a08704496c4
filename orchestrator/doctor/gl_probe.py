"""Prints the OpenGL renderer of this machine; `doctor` runs it as a process, since a bad driver may crash it."""

import sys


def main() -> int:
    """Print the renderer's name, or on stderr why there is none."""
    # Only machines that render have it.
    import moderngl

    try:
        # moderngl's annotation takes the backend's name for its settings.
        context = moderngl.create_standalone_context(backend="egl")  # pyright: ignore[reportArgumentType]
    except Exception as error:  # whatever the driver raises is the answer
        sys.stderr.write(f"{error}\n")
        return 1
    sys.stdout.write(f"{context.info['GL_RENDERER']}\n")
    context.release()
    return 0


if __name__ == "__main__":
    sys.exit(main())
