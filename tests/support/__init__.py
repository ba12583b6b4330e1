"""What tests share: what they are tried on, what they compare with, what they need."""
