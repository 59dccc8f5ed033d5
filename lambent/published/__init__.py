"""Published methods that only benches compare with, one per file; nothing but `bench` imports this package."""
