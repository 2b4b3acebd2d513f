"""The version of this runtime, which is that of linkwise too, and the packages that it runs."""

VERSION = "0.1.0"


def require(version: str) -> None:
    """Raise ImportError unless this runtime runs packages that linkwise `version` generated.

    It runs those of its own minor version, up to its own patch.
    """
    own, asked = (tuple(map(int, text.split("."))) for text in (VERSION, version))
    if own[:2] != asked[:2] or own < asked:
        minor = ".".join(version.split(".")[:2])
        raise ImportError(
            f"this package is made for linkwise_runtime {version}, but {VERSION} is installed: generate it "
            f"again, or install linkwise-runtime {version} or a later one of {minor}"
        )
