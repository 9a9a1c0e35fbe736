from .cdrf_addon import register, unregister  # noqa: F401  (the extension builder wants a package here)
