"""The protocols of MM-Fi: trains and judges as the paper does."""
