MODULE Sections
  PROC p()
    error1:=0;
  BACKWARD
    MoveL p1,v10,fine,tGun;
  ERROR
    IF ERRNO=ERR_A RETRY;
    TRYNEXT;
  UNDO
    Reset do1;
  ENDPROC
  FUNC num f(num a)
    RETURN a;
  ERROR (ERR_A,ERR_B)
    RAISE;
  ENDFUNC
  LOCAL TRAP t
    EXIT;
  ENDTRAP
ENDMODULE
